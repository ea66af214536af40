/* The constant properties of a variable. */

#ifndef VARIABLE_H
#define VARIABLE_H

typedef enum { RESULT, INPUT, TUNABLE, FIXED, STATE } Access;

/* The results that must be recomputed before a variable is read. */
enum { FRESH = 0, STALE_STATES = 1, STALE_OUTPUTS = 2, STALE_RATES = 4, STALE_ALL = 7 };

typedef struct {
    const char *name, *unit;
    Access access;
    double start, low, high, nominal;
    int stale;   /* the results on which it depends */
    int known;   /* index among the knowns of a directional derivative (inputs, states, parameters), or -1 */
    int unknown; /* index among the unknowns (outputs, derivatives, states), or -1 */
} Variable;

#endif
