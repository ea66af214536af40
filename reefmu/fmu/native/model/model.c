/* Evaluation and steps of the model: generated functions around the contacts, in the order that the generated
   stage_order.c contains.

   A function that can fail returns 0 if a result is not finite, and then leaves all values that the host can read
   unchanged. */

typedef int Generated(const double **, double **, casadi_int *, double *, int);

static double *run(Instance *instance, Generated *function, double *result, const double **arguments) {
    double *results[1] = {result};
    function(arguments, results, instance->integers, instance->work, 0);
    return result;
}
#define RUN(function, result, ...) run(instance, function, result, (const double *[]){__VA_ARGS__})

/* Zero times a NaN or an infinity is NaN, so one sum finds them all. */
static int all_finite(const double *values, size_t count) {
    double sum = 0.0;
    for (size_t k = 0; k < count; k++) sum += values[k] * 0.0;
    return sum == 0.0;
}

/* One evaluation of the model: states, inputs and parameters, and the intermediate results of the stages. */
typedef struct {
    const double *x, *u, *p;
    int buffer; /* which of instance->next_states was written last */
    double k[2];
    Slice slice;
    Contact contact;
} Evaluation;

/* A buffer for the next states: a generated function must not write to its own arguments. */
static double *next_states(Instance *instance, Evaluation *at) {
    at->buffer = !at->buffer;
    return instance->next_states[at->buffer];
}

static int same(const double *a, const double *b, size_t count) {
    for (size_t k = 0; k < count; k++)
        if (a[k] != b[k]) return 0;
    return 1;
}

/* Solves the contacts at the contact point q, unless the solution there is known. */
static void solve_at(Instance *instance, Evaluation *at, const double *q) {
    update_slice(&at->slice, &instance->tables, instance->coefficients, q);
    if (!at->contact.known || !same(q, at->contact.point, N_CONTACT_POINT) ||
        !same(instance->coefficients, at->contact.coefficients, N_COEFFICIENTS))
        solve_contacts(&at->slice, q, &at->contact);
}

#include "stage_order.c"

static void begin_evaluation(Instance *instance, Evaluation *at, const double *x) {
    double *v = instance->now.values;
    at->x = x, at->u = v + AT_INPUTS, at->p = v + AT_PARAMETERS;
    at->buffer = 0;
    at->slice.tables = NULL;
#if HAS_CONTACT_FUNCTION
    at->slice.integers = instance->integers, at->slice.work = instance->work;
#endif
    at->contact.known = 0;
    evaluate_kinematics(instance, at);
}

#if IS_JOINT
static void apply_kick(Instance *instance, Evaluation *at, double dt, double gradient) {
    const double *contact_outputs = evaluate_contacts(instance, at);
    double *x = next_states(instance, at);
    RUN(kick, x, at->x, at->u, &dt, &gradient, at->k, at->p, contact_outputs);
    at->x = x;
}

/* One substep: see reefmu/fmu/model/joint_equations.py. */
static void substep(Instance *instance, Evaluation *at, double h) {
    apply_kick(instance, at, h / 6.0, 0.0);
    apply_drift(instance, at, h / 2.0);
    apply_kick(instance, at, 2.0 * h / 3.0, h * h / 24.0);
    apply_drift(instance, at, h / 2.0);
    apply_kick(instance, at, h / 6.0, 0.0);
}
#endif

/* The change dc of the outputs of the contacts along a direction of inputs, states and parameters; returns the outputs.
   */
static const double *contact_change(Instance *instance, Evaluation *at, const double *direction, double *dc) {
    double dq[N_CONTACT_POINT], dr[N_COEFFICIENTS];
    const double *contact_outputs = evaluate_contacts(instance, at);
    RUN(contact_point_jvp, dq, at->x, at->u, at->p, direction);
    RUN(coefficients_jvp, dr, at->p, direction);
    contact_jvp(&at->slice, &at->contact, dq, dr, dc);
    return contact_outputs;
}

/* Directional derivative of outputs and rates along such a direction. */
static void evaluate_jvp(Instance *instance, Evaluation *at, const double *direction, double *result) {
    double dc[N_CONTACT];
    const double *contact_outputs = contact_change(instance, at, direction, dc);
    RUN(result_jvp, result, at->x, at->u, at->p, direction, contact_outputs, dc);
}

#if IS_JOINT
/* Recomputes the longest substep: the states of the effects add to the stiffness as they follow the motion. */
static void update_max_step(Instance *instance) {
    double probes[2 * N_STATES], rates[N_STATES], change_of[N_UNKNOWNS], direction[N_KNOWNS] = {0.0}, added = 0.0;
    const double *p = instance->now.values + AT_PARAMETERS;
    RUN(probe_states, probes, p);
    for (int k = 0; k < 2; k++) {
        Evaluation at;
        begin_evaluation(instance, &at, probes + k * N_STATES);
        evaluate_contacts(instance, &at);
        evaluate_rate(instance, &at, rates);
        for (int state = N_MOTION; state < N_STATES; state++) {
            direction[N_INPUTS + state] = 1.0;
            evaluate_jvp(instance, &at, direction, change_of);
            direction[N_INPUTS + state] = 0.0;
            added += 2.0 * fabs(change_of[TORQUE_OUTPUT] * rates[state]);
            added += 2.0 * fabs(change_of[CRANK_TORQUE_OUTPUT] * rates[state] * probes[1]);
        }
    }
    RUN(max_step, &instance->max_step, p, &added);
}
#endif

/* Recomputes the coefficients after a change of parameters; after a reset also decodes the tables. */
static void update_coefficients(Instance *instance) {
    const double *p = instance->now.values + AT_PARAMETERS;
    if (!instance->coefficients_known) decode_tables(&instance->tables);
    else if (memcmp(p, instance->coefficient_parameters, N_PARAMETERS * sizeof(double)) == 0) return;
    memcpy(instance->coefficient_parameters, p, N_PARAMETERS * sizeof(double));
    instance->coefficients_known = 1;
    RUN(coefficients, instance->coefficients, p);
#if IS_JOINT
    update_max_step(instance);
#endif
}

#include "start.c"

/* Sets instance->tangent, the directional derivative of outputs and rates along instance->direction. starts: at
   initialisation, where the change of the states follows from those of inputs and parameters. */
static int update_tangent(Instance *instance, int starts) {
    Evaluation at;
    update_coefficients(instance);
    if (starts && N_STATES) initial_change(instance);
    begin_evaluation(instance, &at, instance->now.values + AT_STATES);
    evaluate_jvp(instance, &at, instance->direction, instance->tangent);
    return all_finite(instance->tangent, N_UNKNOWNS) && all_finite(instance->direction, N_KNOWNS);
}

/* Stores the outputs; in continuous-time mode the discrete one keeps its value until the next event. */
static void store_outputs(Instance *instance, const double *outputs) {
    double *stored = instance->now.values + AT_OUTPUTS, before = stored[DISCRETE_OUTPUT];
    memcpy(stored, outputs, N_OUTPUTS * sizeof(double));
    instance->now.next_discrete = stored[DISCRETE_OUTPUT];
    if (instance->now.phase == CONTINUOUS_MODE) stored[DISCRETE_OUTPUT] = before;
}

/* Recomputes those of the `wanted` results that are stale. */
static int refresh(Instance *instance, int wanted) {
    double *v = instance->now.values, *next = instance->next_states[0], *outputs = instance->next_outputs;
    int stale = instance->now.stale & (wanted | STALE_STATES);
    Evaluation at;
    if (!stale) return 1;
    update_coefficients(instance);
    if (stale & STALE_STATES && N_STATES) {
        if (!initial_states(instance, next)) return 0;
        memcpy(v + AT_STATES, next, N_STATES * sizeof(double));
    }
    if (stale & (STALE_OUTPUTS | STALE_RATES)) {
        begin_evaluation(instance, &at, v + AT_STATES);
        evaluate_contacts(instance, &at);
        if (stale & STALE_OUTPUTS) {
            evaluate_output(instance, &at, outputs);
            if (!all_finite(outputs, N_OUTPUTS)) return 0;
        }
        if (stale & STALE_RATES && N_STATES) {
            evaluate_rate(instance, &at, next);
            if (!all_finite(next, N_STATES)) return 0;
            memcpy(v + AT_RATES, next, N_STATES * sizeof(double));
        }
        if (stale & STALE_OUTPUTS) store_outputs(instance, outputs);
    }
    instance->now.stale &= ~stale;
    return 1;
}

/* Advances states and outputs by dt seconds at constant inputs. */
static int advance_step(Instance *instance, double dt) {
    double *v = instance->now.values, *outputs = instance->next_outputs;
    Evaluation at;
    update_coefficients(instance);
    begin_evaluation(instance, &at, v + AT_STATES);
#if HAS_SERIES_COMPLIANCE
    at.contact = instance->now.contact;
#endif
#if IS_JOINT
    double count;
    if (!(instance->max_step > 0.0) || !(dt / instance->max_step < MAX_SUBSTEPS)) return 0;
    count = fmax(1.0, ceil(dt / instance->max_step));
    for (long k = 0; k < (long)count; k++) substep(instance, &at, dt / count);
#else
    apply_drift(instance, &at, dt);
#endif
    evaluate_contacts(instance, &at);
    evaluate_output(instance, &at, outputs);
    if (!all_finite(at.x, N_STATES) || !all_finite(outputs, N_OUTPUTS)) return 0;
    store_outputs(instance, outputs);
    if (N_STATES) memcpy(v + AT_STATES, at.x, N_STATES * sizeof(double));
#if HAS_SERIES_COMPLIANCE
    instance->now.contact = at.contact;
#endif
    instance->now.stale = STALE_RATES;
    return 1;
}

/* At the end of an integrator step: adds the change of the stored angles, which follows from the speeds. */
static void accumulate_path(Instance *instance) {
    for (int k = 0; k < N_INDICATORS; k++) {
        double now = instance->now.values[AT_STATES + FIRST_INDICATOR + k];
        instance->now.path_from_speeds[k] += fabs(now - instance->now.last_path_values[k]);
        instance->now.last_path_values[k] = now;
    }
}
