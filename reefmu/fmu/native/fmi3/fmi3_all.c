/* The FMU for FMI 3.0 as one translation unit: compile only this file. It contains the unit for FMI 2.0 with static
   functions; every function of FMI 3.0 calls one of FMI 2.0 or is refused. */

#define FMI2_EXPORT static
#define IS_FMI3
#include "fmi2_all.c"

#include "fmi3_api.h"
#include "fmi3_instance.c"
#include "fmi3_variables.c"
#include "fmi3_simulation.c"
#include "fmi3_unsupported.c"
