/* A sampled proportional-derivative controller of the motor's angle, with a bounded torque:

       motor.tau = stiffness (ratio reference - crank.phi) - damping crank.w,  at most `limit` in magnitude.

   It provides what model.c provides for a drive; it has no states. */

static int all_finite(const double *values, size_t count) {
    double sum = 0.0;
    for (size_t k = 0; k < count; k++) sum += values[k] * 0.0;
    return sum == 0.0;
}

static double unlimited_torque(const double *v) {
    return v[STIFFNESS] * (v[RATIO] * v[REFERENCE] - v[CRANK_PHI]) - v[DAMPING] * v[CRANK_W];
}

static int advance_step(Instance *instance, double dt) {
    double *v = instance->now.values, torque = unlimited_torque(v);
    (void)dt;
    if (!all_finite(&torque, 1)) return 0;
    v[MOTOR_TAU] = torque > v[LIMIT] ? v[LIMIT] : torque < -v[LIMIT] ? -v[LIMIT] : torque;
    instance->now.stale = FRESH;
    return 1;
}

static int refresh(Instance *instance, int wanted) {
    return !(instance->now.stale & wanted & STALE_OUTPUTS) || advance_step(instance, 0.0);
}

/* Along instance->direction, a change of the two inputs and of the parameters in their order. */
static int update_tangent(Instance *instance, int starts) {
    const double *v = instance->now.values, *d = instance->direction, *dp = d + N_INPUTS - AT_PARAMETERS;
    double torque = unlimited_torque(v);
    (void)starts;
    if (torque > v[LIMIT]) instance->tangent[0] = dp[LIMIT];
    else if (torque < -v[LIMIT]) instance->tangent[0] = -dp[LIMIT];
    else
        instance->tangent[0] = v[STIFFNESS] * (dp[RATIO] * v[REFERENCE] + v[RATIO] * dp[REFERENCE] - d[CRANK_PHI]) +
                               dp[STIFFNESS] * (v[RATIO] * v[REFERENCE] - v[CRANK_PHI]) - v[DAMPING] * d[CRANK_W] -
                               dp[DAMPING] * v[CRANK_W];
    return all_finite(instance->tangent, 1);
}

static const char *no_result(const Instance *instance) {
    (void)instance;
    return NO_FINITE_RESULT;
}

static void accumulate_path(Instance *instance) { (void)instance; }
