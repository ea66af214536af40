/* The MuJoCo plugin as one translation unit: compile only this file. It exports no symbol, so that any number of drives
   can be loaded into one process. */

#include <mujoco/mujoco.h>

#include "instance.h"
#include "plugin.h"

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wunused-variable"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#endif
/* Inlined in place of the library functions. As there, a NaN as the second argument gives the first argument. */
static double lesser(double a, double b) { return b < a ? b : a; }
static double greater(double a, double b) { return b > a ? b : a; }
#define fmin lesser
#define fmax greater
#define CASADI_SYMBOL_EXPORT static
#include "equations.c"

#include "table_decoding.c"
#include "bspline.c"
#include "contact.c"
#include "contact_jvp.c"
#include "model.c"
#include "mujoco_stability.c"
#include "mujoco_settings.c"
#include "mujoco_plugin.c"
