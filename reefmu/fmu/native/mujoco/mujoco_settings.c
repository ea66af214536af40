/* The settings of one drive in a MuJoCo model: its joints, and the parameters that its MJCF element states. Wrong
   settings end in mju_error, which MuJoCo's Python package raises as an exception. */

/* One drive of one mjData. It does not change during a simulation except for the working memory in `instance`. */
typedef struct {
    Instance instance;
    int motor, motor_angle; /* addresses of the motor's coordinate theta in qvel and qpos */
    int twist, twist_angle; /* and of delta, minus the twist */
    double temperature;
    double path_factors[N_PATHS];
    int shortens; /* whether a path factor differs from 1 */
} Gear;

static const char *name_of(const mjModel *m, int type, int id) {
    const char *name = mj_id2name(m, type, id);
    return name && *name ? name : "(without a name)";
}

static int is_hinge(const mjModel *m, int joint) { return m->jnt_type[joint] == mjJNT_HINGE; }

static int coaxial(const mjModel *m, int a, int b) {
    double distance = 0.0;
    for (int k = 0; k < 3; k++)
        distance += fabs(m->jnt_axis[3 * a + k] - m->jnt_axis[3 * b + k]) +
                    fabs(m->jnt_pos[3 * a + k] - m->jnt_pos[3 * b + k]);
    return distance < 1e-9;
}

/* The joints: the last two of the body that holds the plugin. */
static void find_joints(const mjModel *m, int plugin, Gear *gear) {
    int body = 0, first, count;
    while (body < m->nbody && m->body_plugin[body] != plugin) body++;
    if (body == m->nbody) mju_error("%s: expected the plugin inside the body of its joint, got none", PLUGIN_NAME);
    first = m->body_jntadr[body], count = m->body_jntnum[body];
    if (count < 2 || !is_hinge(m, first + count - 1) || !is_hinge(m, first + count - 2) ||
        !coaxial(m, first + count - 2, first + count - 1))
        mju_error("%s in body %s: expected two hinges on one axis as its last joints, that of the motor and that of "
                  "the twist, got %d joints",
                  PLUGIN_NAME, name_of(m, mjOBJ_BODY, body), count);
    gear->motor = m->jnt_dofadr[first + count - 2], gear->motor_angle = m->jnt_qposadr[first + count - 2];
    gear->twist = m->jnt_dofadr[first + count - 1], gear->twist_angle = m->jnt_qposadr[first + count - 1];
}

/* The number of a configuration attribute; `value` where the MJCF does not state it. */
static double setting(const mjModel *m, int plugin, const char *name, double value, double low, double high) {
    const char *text = mj_getPluginConfig(m, plugin, name);
    char *end;
    if (!text || !*text) return value;
    value = strtod(text, &end);
    if (*end || !(value >= low && value <= high))
        mju_error("%s: %s: expected a number from %g to %g in SI units, got '%.40s'", PLUGIN_NAME, name, low, high,
                  text);
    return value;
}

static void read_parameters(const mjModel *m, int plugin, Gear *gear) {
    double *values = gear->instance.now.values;
    for (int k = 0; k < N_VALUES; k++) {
        const Variable *v = VARIABLES + k;
        values[k] = v->start;
        if (v->access == TUNABLE) values[k] = setting(m, plugin, v->name, v->start, v->low, v->high);
    }
    gear->temperature = setting(m, plugin, "temperature", values[AT_INPUTS + U_TEMPERATURE], -273.15, 1000.0);
}

/* Refuses a time step that the spring of the contacts makes unstable, and adapts friction to it. While the model is
   compiled, the inertia at the joint is not known yet, and nothing is refused. */
static void adapt_to_step(const mjModel *m, Gear *gear) {
    double step = m->opt.timestep, phase = max_phase(m), added = m->dof_armature[gear->twist];
    double weight = m->dof_invweight0[gear->twist], needed, inertia;
    Stiffness stiffness;
    gear->instance.now.values[AT_INPUTS + U_TEMPERATURE] = gear->temperature;
    stiffness = greatest_stiffness(&gear->instance);
    needed = (step * step * stiffness.contacts + 2.0 * step * stiffness.damping) / phase;
    inertia = weight > 0.0 ? fmax(added, 1.0 / weight) : fmax(added, needed);
    if (needed > inertia)
        mju_error("%s: joint %s: expected armature of at least %.3g kg.m2 for the time step of %g s, got %g; the "
                  "drive's spring would be unstable",
                  PLUGIN_NAME, name_of(m, mjOBJ_JOINT, m->dof_jntid[gear->twist]), needed, step, added);
    set_path_factors(&stiffness, inertia, m->dof_armature[gear->motor], step, phase, gear->path_factors);
    gear->shortens = 0;
    for (int k = 0; k < N_PATHS; k++) gear->shortens |= gear->path_factors[k] < 1.0;
}
