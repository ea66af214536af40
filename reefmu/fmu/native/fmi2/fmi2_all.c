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

#include "log.c"
#include "calls.c"
#include "tables.c"
#include "contact.c"
#include "contact_change.c"
#include "model.c"
#include "life.c"
#include "values.c"
#include "saved.c"
#include "derivatives.c"
#include "cosimulation.c"
#include "exchange.c"
