/* What is known of a variable beforehand. */

#ifndef VARIABLE_H
#define VARIABLE_H

typedef enum { RESULT, INPUT, TUNABLE, FIXED } Access;

/* What has to be computed anew before it is read. */
enum { FRESH = 0, STALE_STATES = 1, STALE_OUTPUTS = 2, STALE_RATES = 4, STALE_ALL = 7 };

typedef struct {
    const char *name, *unit;
    Access access;
    double start, low, high, nominal;
    int stale;      /* what must be fresh to read it */
    int known;      /* column of an input or state in the matrix of partial derivatives, or -1 */
    int unknown;    /* row of an output or derivative, or -1 */
} Variable;

#endif
