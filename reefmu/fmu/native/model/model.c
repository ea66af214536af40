/* The model: generated functions before and after the contacts, and in which order they are run.

   Functions that can fail return 0 and change nothing of what the host sees if a result is not finite. */

typedef int Generated(const double **, double **, casadi_int *, double *, int);

static void run(Instance *instance, Generated *function, double *result, const double **arguments) {
    double *results[1] = {result};
    function(arguments, results, instance->integers, instance->work, 0);
}
#define RUN(function, result, ...) run(instance, function, result, (const double *[]){__VA_ARGS__})

/* One sum finds any NaN or infinity among the values. */
static int all_finite(const double *values, size_t count) {
    double sum = 0.0;
    for (size_t k = 0; k < count; k++) sum += values[k] * 0.0;
    return sum == 0.0;
}

/* Where the drive stands: states, and what follows from them and the inputs. */
typedef struct {
    const double *x, *u, *p;
    int turn; /* which of instance->next_states was written last */
    double k[2];
    Slice slice;
    Contact contact;
} Place;

static void place_at(Instance *instance, Place *place, const double *x) {
    double *v = instance->now.values;
    place->x = x, place->u = v + AT_INPUTS, place->p = v + AT_PARAMETERS;
    place->turn = 0;
    place->slice.tables = NULL;
#if IS_INDIVIDUAL
    place->slice.integers = instance->integers, place->slice.work = instance->work;
#endif
    place->contact.known = 0;
    RUN(kinematics, place->k, x, place->u, place->p);
}

/* Room for the next states: a generated function may not read where it writes. */
static double *next_states(Instance *instance, Place *place) {
    place->turn = !place->turn;
    return instance->next_states[place->turn];
}

static int same(const double *a, const double *b, size_t count) {
    for (size_t k = 0; k < count; k++)
        if (a[k] != b[k]) return 0;
    return 1;
}

/* What the contacts give, unless that is known already. */
static const double *contacts(Instance *instance, Place *place) {
    double q[N_CONTACT_POINT];
    RUN(contact_point, q, place->x, place->u, place->k, place->p);
    cut(&place->slice, &instance->tables, instance->coefficients, q);
    if (!place->contact.known || !same(q, place->contact.at, N_CONTACT_POINT) ||
        !same(instance->coefficients, place->contact.coefficients, N_COEFFICIENTS))
        touch(&place->slice, q, &place->contact);
    return place->contact.gives;
}

/* States after dt with the inputs held. */
static void drift(Instance *instance, Place *place, double dt) {
    double *x;
    (void)instance, (void)place, (void)dt, (void)x;
#if IS_JOINT
    x = next_states(instance, place);
    RUN(coast, x, place->x, &dt);
    place->x = x;
    RUN(kinematics, place->k, x, place->u, place->p);
#endif
#if HAS_ANGLE_STATES
    x = next_states(instance, place);
    RUN(advance_angles, x, place->x, place->u, place->k, place->p);
    place->x = x;
#endif
#if HAS_TIME_STATES
    x = next_states(instance, place);
    RUN(advance_time, x, place->x, place->u, place->k, &dt, place->p,
        TIME_STATES_NEED_TORQUE ? contacts(instance, place) : NULL);
    place->x = x;
#endif
}

#if IS_JOINT
static void push(Instance *instance, Place *place, double dt, double gradient) {
    const double *gives = contacts(instance, place);
    double *x = next_states(instance, place);
    RUN(kick, x, place->x, place->u, &dt, &gradient, place->k, place->p, gives);
    place->x = x;
}

/* One part of a step: see joint_component.py. */
static void part_of_step(Instance *instance, Place *place, double h) {
    push(instance, place, h / 6.0, 0.0);
    drift(instance, place, h / 2.0);
    push(instance, place, 2.0 * h / 3.0, h * h / 24.0);
    drift(instance, place, h / 2.0);
    push(instance, place, h / 6.0, 0.0);
}
#endif

/* Change of outputs and rates for a change of inputs, states and parameters, at a place. */
static void directional(Instance *instance, Place *place, const double *direction, double *result) {
    double dq[N_CONTACT_POINT], dr[N_COEFFICIENTS], dc[N_CONTACT];
    const double *gives = contacts(instance, place);
    RUN(contact_point_jvp, dq, place->x, place->u, place->p, direction);
    RUN(coefficients_jvp, dr, place->p, direction);
    touch_change(&place->slice, &place->contact, dq, dr, dc);
    RUN(result_jvp, result, place->x, place->u, place->p, direction, gives, dc);
}

#if IS_JOINT
/* The longest part of a step: how much the states add to the steepest spring as they follow the motion. */
static void find_pace(Instance *instance) {
    double probes[2 * N_STATES], rates[N_STATES], change_of[N_UNKNOWNS], direction[N_KNOWNS] = {0.0}, added = 0.0;
    const double *p = instance->now.values + AT_PARAMETERS;
    RUN(probe, probes, p);
    for (int k = 0; k < 2; k++) {
        Place place;
        place_at(instance, &place, probes + k * N_STATES);
        RUN(rate, rates, place.x, place.u, place.k, place.p, contacts(instance, &place));
        for (int state = N_MOTION; state < N_STATES; state++) {
            direction[N_INPUTS + state] = 1.0;
            directional(instance, &place, direction, change_of);
            direction[N_INPUTS + state] = 0.0;
            added += 2.0 * fabs(change_of[TORQUE_OUTPUT] * rates[state]);
        }
    }
    RUN(pace, &instance->longest, p, &added);
}
#endif

/* Recomputes the coefficients when a parameter has changed; after a start also unpacks the tables. */
static void update_coefficients(Instance *instance) {
    const double *p = instance->now.values + AT_PARAMETERS;
    if (!instance->coefficients_known) unpack_tables(&instance->tables);
    else if (memcmp(p, instance->coefficients_for, N_PARAMETERS * sizeof(double)) == 0) return;
    memcpy(instance->coefficients_for, p, N_PARAMETERS * sizeof(double));
    instance->coefficients_known = 1;
    RUN(coefficients, instance->coefficients, p);
#if IS_JOINT
    find_pace(instance);
#endif
}

/* instance->tangent: change of outputs and rates for the change instance->direction of inputs, states and parameters;
   starts: the states' change follows from the others'. */
static int tangent(Instance *instance, int starts) {
    Place place;
    update_coefficients(instance);
    place_at(instance, &place, instance->now.values + AT_STATES);
    if (starts && N_STATES) {
        double *change = instance->next_states[0];
        RUN(initial_jvp, change, place.u, place.p, instance->direction);
        memcpy(instance->direction + N_INPUTS, change, N_STATES * sizeof(double));
    }
    directional(instance, &place, instance->direction, instance->tangent);
    return all_finite(instance->tangent, N_UNKNOWNS) && all_finite(instance->direction, N_KNOWNS);
}

/* The outputs; in continuous time the discrete one stays as it is until the next event. */
static void take_outputs(Instance *instance, const double *outputs) {
    double *held = instance->now.values + AT_OUTPUTS, before = held[DISCRETE_OUTPUT];
    memcpy(held, outputs, N_OUTPUTS * sizeof(double));
    instance->now.next_discrete = held[DISCRETE_OUTPUT];
    if (instance->now.phase == CONTINUOUS_MODE) held[DISCRETE_OUTPUT] = before;
}

/* Brings up to date what is stale and among `wanted`. */
static int refresh(Instance *instance, int wanted) {
    double *v = instance->now.values, *next = instance->next_states[0], *outputs = instance->next_outputs;
    int stale = instance->now.stale & (wanted | STALE_STATES);
    Place place;
    if (!stale) return 1;
    update_coefficients(instance);
    if (stale & STALE_STATES && N_STATES) {
        RUN(initial, next, v + AT_INPUTS, v + AT_PARAMETERS);
        if (!all_finite(next, N_STATES)) return 0;
        memcpy(v + AT_STATES, next, N_STATES * sizeof(double));
    }
    if (stale & (STALE_OUTPUTS | STALE_RATES)) {
        const double *gives;
        place_at(instance, &place, v + AT_STATES);
        gives = contacts(instance, &place);
        if (stale & STALE_OUTPUTS) {
            RUN(output, outputs, place.x, place.u, place.k, place.p, gives);
            if (!all_finite(outputs, N_OUTPUTS)) return 0;
        }
        if (stale & STALE_RATES && N_STATES) {
            RUN(rate, next, place.x, place.u, place.k, place.p, gives);
            if (!all_finite(next, N_STATES)) return 0;
            memcpy(v + AT_RATES, next, N_STATES * sizeof(double));
        }
        if (stale & STALE_OUTPUTS) take_outputs(instance, outputs);
    }
    instance->now.stale &= ~stale;
    return 1;
}

/* States and outputs after dt seconds with the inputs held. */
static int take_step(Instance *instance, double dt) {
    double *v = instance->now.values, *outputs = instance->next_outputs;
    Place place;
    update_coefficients(instance);
    place_at(instance, &place, v + AT_STATES);
#if HAS_SERIES_COMPLIANCE
    place.contact = instance->now.contact;
#endif
#if IS_JOINT
    double parts;
    if (!(instance->longest > 0.0) || !(dt / instance->longest < MOST_PARTS)) return 0;
    parts = fmax(1.0, ceil(dt / instance->longest));
    for (long k = 0; k < (long)parts; k++) part_of_step(instance, &place, dt / parts);
#else
    drift(instance, &place, dt);
#endif
    RUN(output, outputs, place.x, place.u, place.k, place.p, contacts(instance, &place));
    if (!all_finite(place.x, N_STATES) || !all_finite(outputs, N_OUTPUTS)) return 0;
    take_outputs(instance, outputs);
    if (N_STATES) memcpy(v + AT_STATES, place.x, N_STATES * sizeof(double));
#if HAS_SERIES_COMPLIANCE
    instance->now.contact = place.contact;
#endif
    instance->now.stale = STALE_RATES;
    return 1;
}

/* At the end of a step: the way that the speeds told since the last catching up. */
static void count_way(Instance *instance) {
    for (int k = 0; k < N_INDICATORS; k++) {
        double now = instance->now.values[AT_STATES + FIRST_INDICATOR + k];
        instance->now.told[k] += fabs(now - instance->now.remembered[k]);
        instance->now.remembered[k] = now;
    }
}
