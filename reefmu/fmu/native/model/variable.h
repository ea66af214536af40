/* What is known of a variable beforehand. */

#ifndef VARIABLE_H
#define VARIABLE_H

typedef enum { RESULT, INPUT, TUNABLE, FIXED, STATE } Access;

/* What has to be computed anew before it is read. */
enum { FRESH = 0, STALE_STATES = 1, STALE_OUTPUTS = 2, STALE_RATES = 4, STALE_ALL = 7 };

typedef struct {
    const char *name, *unit;
    Access access;
    double start, low, high, nominal;
    int stale;      /* what must be fresh to read it */
    int known;   /* place among inputs, states and parameters, which a direction may have, or -1 */
    int unknown; /* place among outputs, derivatives and states, which may follow it, or -1 */
} Variable;

#endif
