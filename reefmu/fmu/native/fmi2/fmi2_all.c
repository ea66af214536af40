/* The FMU as one translation unit: compile only this file. Its only external symbols are the functions of FMI. */

#include "instance.h"

#if defined(__GNUC__)
#pragma GCC visibility push(hidden)
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
#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

#include "fmi2_logging.c"
#include "fmi2_calls.c"
#include "table_decoding.c"
#include "bspline.c"
#include "contact.c"
#include "contact_jvp.c"
#include "model.c"
#include "fmi2_instance.c"
#include "fmi2_variables.c"
#include "fmi2_state.c"
#include "fmi2_derivatives.c"
#include "fmi2_cosimulation.c"
#include "fmi2_model_exchange.c"
