/* The states at the start, where the model has parameters for it. The search is that of
   reefmu/fmu/model/start/start_search.py.

   At a torque of zero the angles give the states. At any other torque their twist is exceeded by the offset at which
   the drive exerts it, and `rest` is what the torque adds to the states once it has been held for long. */

#if HAS_START

static double start_torque(const Instance *instance) { return instance->now.values[AT_PARAMETERS + START_TORQUE]; }

/* Evaluates the contacts and outputs of the states x at an offset; returns the excess of the torque. */
static double evaluate_start(Instance *instance, Evaluation *at, double offset, const double *rest, double *x,
                             double *y) {
    const double *v = instance->now.values;
    RUN(start_states, x, v + AT_INPUTS, v + AT_PARAMETERS, &offset);
    for (int k = 0; k < N_STATES; k++) x[k] += rest[k];
    begin_evaluation(instance, at, x);
    evaluate_contacts(instance, at);
    evaluate_output(instance, at, y);
    return y[TORQUE_OUTPUT] - start_torque(instance);
}

/* Finds the offset, in reach around `center`; 0 where there is none. limits: the torques at the ends of the search. */
static int find_offset(Instance *instance, const double *rest, double center, double *offset, double limits[2]) {
    double x[N_STATES], y[N_OUTPUTS], low = center - START_REACH, high = center + START_REACH, excess;
    double torque = start_torque(instance);
    Evaluation at;
    limits[0] = torque + evaluate_start(instance, &at, low, rest, x, y);
    limits[1] = torque + evaluate_start(instance, &at, high, rest, x, y);
    if (!(limits[0] <= torque && torque <= limits[1])) return 0;
    for (int k = 0; k < START_HALVINGS; k++) {
        double middle = (low + high) / 2.0;
        excess = evaluate_start(instance, &at, middle, rest, x, y);
        if (excess <= 0.0) low = middle;
        if (excess >= 0.0) high = middle;
    }
    *offset = (low + high) / 2.0;
    excess = evaluate_start(instance, &at, *offset, rest, x, y);
    *offset -= excess / fmax(y[STIFFNESS_OUTPUT], START_STIFFNESS_FLOOR);
    return 1;
}

/* Finds the offset of states to which the torque has added nothing yet; 0, with a refusal, out of reach. */
static int first_offset(Instance *instance, double *offset) {
    double x[N_STATES], y[N_OUTPUTS], limits[2], unmoved[N_STATES] = {0.0}, torque = start_torque(instance);
    Evaluation at;
    evaluate_start(instance, &at, 0.0, unmoved, x, y);
    if (find_offset(instance, unmoved, -y[TWIST_OUTPUT], offset, limits)) return 1;
    if (torque < limits[0] || torque > limits[1])
        snprintf(instance->refusal, sizeof instance->refusal, START_REFUSAL, limits[0], limits[1], torque);
    return 0;
}

/* The states at the start; 0 if they are not finite or the torque is out of reach. */
static int initial_states(Instance *instance, double *x) {
    double rest[N_STATES] = {0.0}, first[N_STATES], y[N_OUTPUTS], offset = 0.0, limits[2];
    Evaluation at;
    instance->refusal[0] = '\0';
    if (start_torque(instance) != 0.0) {
        if (!first_offset(instance, &offset)) return 0;
        if (START_SETTLES) {
            evaluate_start(instance, &at, offset, rest, first, y);
            settle_states(instance, &at);
            for (int k = 0; k < N_STATES; k++) rest[k] = at.x[k] - first[k];
            if (!find_offset(instance, rest, offset, &offset, limits)) return 0;
        }
    }
    RUN(start_states, x, instance->now.values + AT_INPUTS, instance->now.values + AT_PARAMETERS, &offset);
    for (int k = 0; k < N_STATES; k++) x[k] += rest[k];
    return all_finite(x, N_STATES);
}

/* Completes a direction of inputs and parameters by the change of the states at an offset, such that the torque follows
   its parameter. change_of_rest: of `rest`. Leaves the evaluation there in `at`, whose states are x. */
static void follow_torque(Instance *instance, Evaluation *at, double offset, const double *rest, double *x,
                          const double *change_of_rest, double *direction) {
    double y[N_OUTPUTS], along[N_KNOWNS] = {0.0}, result[N_UNKNOWNS], zero = 0.0, one = 1.0, excess, step;
    const double *u, *p;
    evaluate_start(instance, at, offset, rest, x, y);
    u = at->u, p = at->p;
    RUN(start_states_jvp, direction + N_INPUTS, u, p, &offset, direction, &zero);
    for (int k = 0; k < N_STATES; k++) direction[N_INPUTS + k] += change_of_rest[k];
    evaluate_jvp(instance, at, direction, result);
    excess = result[TORQUE_OUTPUT] - direction[N_INPUTS + N_STATES + START_TORQUE];
    RUN(start_states_jvp, along + N_INPUTS, u, p, &offset, along, &one);
    evaluate_jvp(instance, at, along, result);
    step = -excess / result[TORQUE_OUTPUT];
    for (int k = 0; k < N_STATES; k++) direction[N_INPUTS + k] += step * along[N_INPUTS + k];
}

/* Completes instance->direction by the change of the states at the start. */
static void initial_change(Instance *instance) {
    double *direction = instance->direction, x[N_STATES], zeros[N_STATES] = {0.0}, offset = 0.0;
    const double *v = instance->now.values;
    Evaluation at;
    if (start_torque(instance) == 0.0) {
        RUN(start_states_jvp, instance->next_states[0], v + AT_INPUTS, v + AT_PARAMETERS, &offset, direction, &offset);
        memcpy(direction + N_INPUTS, instance->next_states[0], N_STATES * sizeof(double));
        return;
    }
    if (!first_offset(instance, &offset)) return;
    follow_torque(instance, &at, offset, zeros, x, zeros, direction);
#if START_SETTLES
    {
        double rest[N_STATES], change[N_STATES], dc[N_CONTACT], limits[2];
        const double *contact_outputs = contact_change(instance, &at, direction, dc);
        RUN(settle_jvp, change, at.x, at.u, at.p, direction, contact_outputs, dc);
        for (int k = 0; k < N_STATES; k++) change[k] -= direction[N_INPUTS + k];
        settle_states(instance, &at);
        for (int k = 0; k < N_STATES; k++) rest[k] = at.x[k] - x[k];
        if (find_offset(instance, rest, offset, &offset, limits))
            follow_torque(instance, &at, offset, rest, x, change, direction);
    }
#endif
}

/* What the host learns where there is no result. */
static const char *no_result(const Instance *instance) {
    return instance->refusal[0] ? instance->refusal : NO_FINITE_RESULT;
}

#else

static const char *no_result(const Instance *instance) {
    (void)instance;
    return NO_FINITE_RESULT;
}

static int initial_states(Instance *instance, double *x) {
    RUN(initial, x, instance->now.values + AT_INPUTS, instance->now.values + AT_PARAMETERS);
    return all_finite(x, N_STATES);
}

static void initial_change(Instance *instance) {
    double *change = instance->next_states[0];
    RUN(initial_jvp, change, instance->now.values + AT_INPUTS, instance->now.values + AT_PARAMETERS,
        instance->direction);
    memcpy(instance->direction + N_INPUTS, change, N_STATES * sizeof(double));
}

#endif
