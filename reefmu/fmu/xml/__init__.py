"""The FMU's descriptions (`fmi2`, `fmi3`) and the zip file that holds them (`archive`)."""
