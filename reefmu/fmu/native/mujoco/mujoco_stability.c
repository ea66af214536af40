/* Which stiffness the time step of the simulator can resolve; the derivation is in reefmu/robots/twist_inertia.py.

   The coordinates are the angle of the motor in terms of the output (theta) and minus the twist (delta). MuJoCo
   advances them by the symplectic Euler method or by Runge-Kutta. A spring K between them is stable if step^2 K is at
   most max_phase times the inertia that acts on delta. */

enum { U_CRANK_ANGLE, U_CRANK_SPEED, U_OUTPUT_ANGLE, U_OUTPUT_SPEED, U_TEMPERATURE };

/* (Eigenfrequency x step)^2 at the limit: 4 for the symplectic Euler method; 8 for Runge-Kutta of fourth order, which
   is stable on the imaginary axis up to sqrt(8) (|1 + z + z^2/2 + z^3/6 + z^4/24| = 1). A little less is allowed. */
static double max_phase(const mjModel *m) { return m->opt.integrator == mjINT_RK4 ? 7.7 : 4.0; }

/* What acts on the two coordinates. The stiffness of friction is that after a reversal, twice that of a new path. */
typedef struct {
    double contacts, damping;          /* N.m/rad and N.m.s/rad, along the twist */
    double by_path[N_PATHS];           /* N.m/rad of the friction that follows twist, crank and output */
} Stiffness;

/* Adds the stiffness of the states that follow the paths which are passed at these speeds, rad/s. */
static void add_friction(Instance *instance, double crank_speed, double output_speed, int path, Stiffness *total) {
    double *v = instance->now.values, *u = v + AT_INPUTS, rates[N_STATES + 1], change[N_UNKNOWNS];
    double direction[N_KNOWNS] = {0.0}, ratio = v[AT_PARAMETERS + RATIO_PARAMETER];
    double speed = path == PATH_OUTPUT ? output_speed : crank_speed / ratio;
    Evaluation at;
    u[U_CRANK_ANGLE] = 0.0, u[U_OUTPUT_ANGLE] = -FULL_TWIST;
    u[U_CRANK_SPEED] = crank_speed, u[U_OUTPUT_SPEED] = output_speed;
    memset(v + AT_STATES, 0, N_STATES * sizeof(double));
    begin_evaluation(instance, &at, v + AT_STATES);
    evaluate_contacts(instance, &at);
    evaluate_rate(instance, &at, rates);
    for (int state = N_INDICATORS; state < N_STATES; state++) {
        double torque;
        if (STATE_PATHS[state] != path || !STATE_FOLLOWS[state]) continue;
        direction[N_INPUTS + state] = 1.0;
        evaluate_jvp(instance, &at, direction, change);
        direction[N_INPUTS + state] = 0.0;
        torque = path == PATH_CRANK ? ratio * change[CRANK_OUTPUT] : change[TORQUE_OUTPUT];
        total->by_path[path] += 2.0 * fabs(torque * rates[state] / speed);
    }
    direction[U_OUTPUT_SPEED] = 1.0;
    evaluate_jvp(instance, &at, direction, change);
    total->damping = fmax(total->damping, fabs(change[TORQUE_OUTPUT]));
}

/* The greatest stiffness along each coordinate. Overwrites the inputs and states of the instance. */
static Stiffness greatest_stiffness(Instance *instance) {
    static const double slow = 1e-6; /* rad/s: the sign of the speed matters, friction has its value at rest */
    double ratio = instance->now.values[AT_PARAMETERS + RATIO_PARAMETER];
    Stiffness total = {0.0, 0.0, {0.0}};
    update_coefficients(instance);
    total.contacts = MAX_STIFFNESS * instance->coefficients[SCALE];
    add_friction(instance, ratio * slow, 0.0, PATH_TWIST, &total);
    add_friction(instance, ratio * slow, slow, PATH_CRANK, &total);
    add_friction(instance, ratio * slow, slow, PATH_OUTPUT, &total);
    return total;
}

/* Factors by which the paths of friction are shortened, so that the step resolves what is stiffer than it allows: a
   presliding length then counts as longer. added, rotor: the inertia that is sure to act on delta and on theta. */
static void set_path_factors(const Stiffness *stiffness, double added, double rotor, double step, double phase,
                             double *factors) {
    double along_twist = (phase * added - 2.0 * step * stiffness->damping) / (step * step) - stiffness->contacts;
    double along_motor = phase * rotor / (step * step);
    const double *k = stiffness->by_path;
    /* (theta + delta)^2 <= 2 theta^2 + 2 delta^2, so friction at the output counts twice on either coordinate. */
    double of_twist = k[PATH_TWIST] + 2.0 * k[PATH_OUTPUT], of_motor = k[PATH_CRANK] + 2.0 * k[PATH_OUTPUT];
    factors[PATH_NONE] = 1.0;
    factors[PATH_TWIST] = of_twist > along_twist ? fmax(along_twist, 0.0) / of_twist : 1.0;
    factors[PATH_CRANK] = of_motor > along_motor ? along_motor / of_motor : 1.0;
    factors[PATH_OUTPUT] = fmin(factors[PATH_TWIST], factors[PATH_CRANK]);
}
