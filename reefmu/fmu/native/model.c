/* The generated functions on an instance's values. Each returns 0 and changes nothing if a result is not finite. */

typedef int Generated(const double **, double **, casadi_int *, double *, int);

static int evaluate(Instance *instance, Generated *function, const double *a, const double *b, const double *c,
                    const double *d, double *result) {
    instance->arguments[0] = a;
    instance->arguments[1] = b;
    instance->arguments[2] = c;
    instance->arguments[3] = d;
    instance->results[0] = result;
    return function(instance->arguments, instance->results, instance->integers, instance->work, 0) == 0;
}

/* One sum finds any NaN or infinity among the values. */
static int all_finite(const double *values, size_t count) {
    double sum = 0.0;
    for (size_t k = 0; k < count; k++) sum += values[k] * 0.0;
    return sum == 0.0;
}

static int compute_outputs(Instance *instance, const double *states) {
    double *v = instance->now.values;
    if (!evaluate(instance, output, states, v + AT_INPUTS, v + AT_PARAMETERS, NULL, instance->next_outputs) ||
        !all_finite(instance->next_outputs, N_OUTPUTS))
        return 0;
    memcpy(v + AT_OUTPUTS, instance->next_outputs, N_OUTPUTS * sizeof(double));
    return 1;
}

/* Brings up to date what is stale and among `wanted`. */
static int refresh(Instance *instance, int wanted) {
    double *v = instance->now.values, *next = instance->next_states[0];
    int stale = instance->now.stale & (wanted | STALE_STATES);
    if (stale & STALE_STATES && N_STATES) {
        if (!evaluate(instance, initial, v + AT_INPUTS, v + AT_PARAMETERS, NULL, NULL, next) ||
            !all_finite(next, N_STATES))
            return 0;
        memcpy(v + AT_STATES, next, N_STATES * sizeof(double));
    }
    if (stale & STALE_OUTPUTS && !compute_outputs(instance, v + AT_STATES)) return 0;
    if (stale & STALE_RATES && N_STATES) {
        if (!evaluate(instance, rate, v + AT_STATES, v + AT_INPUTS, v + AT_PARAMETERS, NULL, next) ||
            !all_finite(next, N_STATES))
            return 0;
        memcpy(v + AT_RATES, next, N_STATES * sizeof(double));
    }
    instance->now.stale &= ~stale;
    return 1;
}

/* States and outputs after dt seconds with the inputs held. */
static int take_step(Instance *instance, double dt) {
    double *v = instance->now.values, part = dt;
    const double *from = v + AT_STATES;
    long count = 1;
#if HAS_PACE
    double longest = 0.0;
    if (!evaluate(instance, pace, v + AT_PARAMETERS, NULL, NULL, NULL, &longest) || !(longest > 0.0)) return 0;
    if (!(dt / longest < MOST_PARTS)) return 0;
    count = (long)ceil(dt / longest);
    if (count < 1) count = 1;
    part = dt / (double)count;
#endif
    for (long k = 0; N_STATES && k < count; k++) {
        double *next = instance->next_states[k % 2];
        if (!evaluate(instance, advance, from, v + AT_INPUTS, &part, v + AT_PARAMETERS, next)) return 0;
        from = next;
    }
    if (!all_finite(from, N_STATES) || !compute_outputs(instance, from)) return 0;
    if (N_STATES) memcpy(v + AT_STATES, from, N_STATES * sizeof(double));
    instance->now.stale = STALE_RATES;
    return 1;
}
