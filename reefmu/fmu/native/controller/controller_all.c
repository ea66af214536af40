/* The controller's FMU as one translation unit, with the functions of FMI that the drive's FMU has. */

#include "instance.h"

#include "fmi2_logging.c"
#include "fmi2_calls.c"
#include "controller.c"
#include "fmi2_instance.c"
#include "fmi2_variables.c"
#include "fmi2_state.c"
#include "fmi2_derivatives.c"
#include "fmi2_cosimulation.c"
