/* The FMU for FMI 3.0 in one translation unit: compile this file alone. That for 2.0 is inside, its functions kept to
   this file, and every call of 3.0 is one of 2.0 or is refused. */

#define FMI2_EXPORT static
#define IS_FMI3
#include "fmi2_all.c"

#include "fmi3_api.h"
#include "fmi3_instance.c"
#include "fmi3_variables.c"
#include "fmi3_simulation.c"
#include "fmi3_unsupported.c"
