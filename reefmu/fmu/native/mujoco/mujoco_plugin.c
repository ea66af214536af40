/* The callbacks of MuJoCo.

   The generalised forces are those of the drive's torques on crank and output: the output turns with theta + delta, the
   crank with ratio x theta. The states of the effects are in mjData.plugin_state, behind the time at which they were
   advanced last, so that resets, copies, saved states and rollouts contain them. */

enum { STATE_TIME, STATE_PHASE, FIRST_STATE };
/* States before the first step are those of the present angles, which may still be set; see `load_states`. */
enum { NOT_STARTED, PROVISIONAL, STARTED };

static Gear *gear_of(const mjData *d, int plugin) { return (Gear *)d->plugin_data[plugin]; }

static int plugin_nstate(const mjModel *m, int plugin) {
    (void)m, (void)plugin;
    return N_STATES ? FIRST_STATE + N_STATES : 0;
}

static int plugin_nsensordata(const mjModel *m, int plugin, int sensor) {
    (void)m, (void)plugin, (void)sensor;
    return N_OUTPUTS;
}

static int plugin_init(const mjModel *m, mjData *d, int plugin) {
    Gear *gear = calloc(1, sizeof *gear);
    if (!gear) mju_error("%s: out of memory", PLUGIN_NAME);
    d->plugin_data[plugin] = (uintptr_t)gear;
    find_joints(m, plugin, gear);
    read_parameters(m, plugin, gear);
    adapt_to_step(m, gear);
    return 0;
}

static void plugin_destroy(mjData *d, int plugin) {
    free(gear_of(d, plugin));
    d->plugin_data[plugin] = 0;
}

static void plugin_reset(const mjModel *m, mjtNum *state, void *data, int plugin) {
    (void)data;
    for (int k = 0; k < plugin_nstate(m, plugin); k++) state[k] = 0.0;
}

/* Angles are counted from those of the model's initial configuration, in which the drive is not twisted. */
static void read_motion(const mjModel *m, const mjData *d, Gear *gear) {
    double *v = gear->instance.now.values, *u = v + AT_INPUTS, ratio = v[AT_PARAMETERS + RATIO_PARAMETER];
    double theta = d->qpos[gear->motor_angle] - m->qpos0[gear->motor_angle], speed = d->qvel[gear->motor];
    double delta = d->qpos[gear->twist_angle] - m->qpos0[gear->twist_angle];
    u[U_CRANK_ANGLE] = ratio * theta, u[U_CRANK_SPEED] = ratio * speed;
    u[U_OUTPUT_ANGLE] = theta + delta, u[U_OUTPUT_SPEED] = speed + d->qvel[gear->twist];
    u[U_TEMPERATURE] = gear->temperature;
}

/* The present value of the angle that a stored angle follows. */
static double angle_along(const Evaluation *at, int path) {
    if (path == PATH_TWIST) return at->u[U_CRANK_ANGLE] / at->p[RATIO_PARAMETER] - at->u[U_OUTPUT_ANGLE];
    return at->u[path == PATH_CRANK ? U_CRANK_ANGLE : U_OUTPUT_ANGLE];
}

/* Whether the states are those of the present angles already, as at the beginning of every step. */
static int at_stored_angles(const Evaluation *at) {
    for (int k = 0; k < N_INDICATORS; k++)
        if (at->x[k] != angle_along(at, STATE_PATHS[k])) return 0;
    return 1;
}

/* Advances the states from the stored angles to the present ones, and over dt seconds; `stored` is left unchanged. */
static void advance_states(Gear *gear, Evaluation *at, double dt, const double *stored, double *result) {
    Instance *instance = &gear->instance;
    begin_evaluation(instance, at, stored);
    if (dt == 0.0 && at_stored_angles(at)) {
        memcpy(result, stored, N_STATES * sizeof(double));
        at->x = result;
        return;
    }
    apply_drift(instance, at, dt);
    memcpy(result, at->x, N_STATES * sizeof(double));
    if (gear->shortens) {
        double start[N_STATES + 1];
        memcpy(start, stored, N_STATES * sizeof(double));
        for (int k = 0; k < N_INDICATORS; k++) {
            double angle = angle_along(at, STATE_PATHS[k]);
            start[k] = angle + gear->path_factors[STATE_PATHS[k]] * (stored[k] - angle);
        }
        begin_evaluation(instance, at, start);
        apply_drift(instance, at, dt);
        for (int k = N_INDICATORS; k < N_STATES; k++)
            if (STATE_FOLLOWS[k]) result[k] = at->x[k];
    }
    at->x = result;
}

/* The time to which the stored states belong. */
static double *last_time(const mjModel *m, mjData *d, int plugin) {
    return d->plugin_state + m->plugin_stateadr[plugin] + STATE_TIME;
}

/* Copies the stored states. Before the first step they are those of the angles at its start; within it, Runge-Kutta
   calls at later times and other angles. */
static void load_states(const mjModel *m, mjData *d, int plugin, double *x) {
    Gear *gear = gear_of(d, plugin);
    double *state = d->plugin_state + m->plugin_stateadr[plugin], since = d->time - state[STATE_TIME];
    if (state[STATE_PHASE] == NOT_STARTED ||
        (state[STATE_PHASE] == PROVISIONAL && !(since > 0.0 && since < 1.001 * m->opt.timestep))) {
        const double *v = gear->instance.now.values;
        Instance *instance = &gear->instance;
        RUN(initial, state + FIRST_STATE, v + AT_INPUTS, v + AT_PARAMETERS);
        state[STATE_PHASE] = PROVISIONAL;
        state[STATE_TIME] = d->time;
    }
    memcpy(x, state + FIRST_STATE, N_STATES * sizeof(double));
}

/* The outputs at the present motion and states. */
static void outputs_now(const mjModel *m, mjData *d, int plugin, double *outputs) {
    Gear *gear = gear_of(d, plugin);
    Instance *instance = &gear->instance;
    double stored[N_STATES + 1], x[N_STATES + 1];
    Evaluation at;
    read_motion(m, d, gear);
    if (N_STATES) {
        load_states(m, d, plugin, stored);
        advance_states(gear, &at, fmax(d->time - *last_time(m, d, plugin), 0.0), stored, x);
    } else begin_evaluation(instance, &at, x);
    evaluate_contacts(instance, &at);
    evaluate_output(instance, &at, outputs);
}

static void plugin_compute(const mjModel *m, mjData *d, int plugin, int capability) {
    Gear *gear = gear_of(d, plugin);
    double outputs[N_OUTPUTS];
    outputs_now(m, d, plugin, outputs);
    if (capability == mjPLUGIN_SENSOR) {
        for (int k = 0; k < m->nsensor; k++)
            if (m->sensor_type[k] == mjSENS_PLUGIN && m->sensor_plugin[k] == plugin)
                memcpy(d->sensordata + m->sensor_adr[k], outputs, sizeof outputs);
        return;
    }
    d->qfrc_passive[gear->twist] += outputs[TORQUE_OUTPUT];
    d->qfrc_passive[gear->motor] +=
        outputs[TORQUE_OUTPUT] + gear->instance.now.values[AT_PARAMETERS + RATIO_PARAMETER] * outputs[CRANK_OUTPUT];
}

/* At the end of a step, with the new angles. */
static void plugin_advance(const mjModel *m, mjData *d, int plugin) {
    Gear *gear = gear_of(d, plugin);
    double *state = d->plugin_state + m->plugin_stateadr[plugin], stored[N_STATES + 1];
    Evaluation at;
    read_motion(m, d, gear);
    memcpy(stored, state + FIRST_STATE, N_STATES * sizeof(double));
    advance_states(gear, &at, fmax(d->time - state[STATE_TIME], 0.0), stored, state + FIRST_STATE);
    state[STATE_TIME] = d->time;
    state[STATE_PHASE] = STARTED;
}

mjPLUGIN_LIB_INIT(reefmu_drive) {
    mjpPlugin plugin;
    if (mjp_getPlugin(PLUGIN_NAME, NULL)) {
        mju_warning("%s: a plugin of this name is loaded already and stays; export drives that differ to folders of "
                    "different names", PLUGIN_NAME);
        return;
    }
    mjp_defaultPlugin(&plugin);
    plugin.name = PLUGIN_NAME;
    plugin.nattribute = sizeof ATTRIBUTES / sizeof *ATTRIBUTES;
    plugin.attributes = ATTRIBUTES;
    plugin.capabilityflags = mjPLUGIN_PASSIVE | mjPLUGIN_SENSOR;
    plugin.needstage = mjSTAGE_VEL;
    plugin.nstate = plugin_nstate;
    plugin.nsensordata = plugin_nsensordata;
    plugin.init = plugin_init;
    plugin.destroy = plugin_destroy;
    plugin.reset = plugin_reset;
    plugin.compute = plugin_compute;
    plugin.advance = N_STATES ? plugin_advance : NULL;
    mjp_registerPlugin(&plugin);
}
