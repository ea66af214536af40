/* The FMU in one translation unit: compile this file alone. No function but those of FMI leaves it. */

#include "instance.h"

#if defined(__GNUC__)
#pragma GCC visibility push(hidden)
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wunused-variable"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#endif
/* The library's versions cost a call. As there, a NaN in second place gives the first. */
static double lesser(double a, double b) { return b < a ? b : a; }
static double greater(double a, double b) { return b > a ? b : a; }
#define fmin lesser
#define fmax greater
#define CASADI_SYMBOL_EXPORT static
#include "equations.c"
#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#include "fmi2_logging.c"
#include "fmi2_calls.c"
#include "spline_tables.c"
#include "contact.c"
#include "contact_jvp.c"
#include "model.c"
#include "fmi2_instance.c"
#include "fmi2_variables.c"
#include "fmi2_state.c"
#include "fmi2_derivatives.c"
#include "fmi2_cosimulation.c"
#include "fmi2_model_exchange.c"
