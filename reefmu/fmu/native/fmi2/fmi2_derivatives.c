/* Directional derivatives (FMI 2.0.4, section 2.1.9; FMI 3.0.2, section 2.2.11).

   After initialisation the knowns are inputs and states, the unknowns outputs and derivatives. During initialisation
   the states depend on inputs and parameters: these are the knowns, and the unknowns include the states. */

static int is_known(const Instance *instance, size_t index) {
    int starts = instance->now.phase == INITIALISING;
    Access access = index < N_VALUES ? VARIABLES[index].access : RESULT;
    return access == INPUT || (starts ? access == TUNABLE || access == FIXED : access == STATE);
}

static int is_unknown(const Instance *instance, size_t index) {
    int starts = instance->now.phase == INITIALISING;
    return index < N_VALUES && VARIABLES[index].unknown >= 0 && (starts || VARIABLES[index].access != STATE);
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetDirectionalDerivative)(
    fmi2Component component, const fmi2ValueReference unknowns[], size_t n_unknowns, const fmi2ValueReference knowns[],
    size_t n_knowns, const fmi2Real directions[], fmi2Real results[]) {
    Instance *instance = component;
    const Call *call = &CALL_GetDirectionalDerivative;
    if (!allowed(instance, call) || !has_array(instance, call, unknowns, n_unknowns) ||
        !has_array(instance, call, knowns, n_knowns) || !has_array(instance, call, directions, n_knowns) ||
        !has_array(instance, call, results, n_unknowns))
        return fmi2Error;
    for (size_t k = 0; k < n_unknowns + n_knowns; k++) {
        int known = k >= n_unknowns;
        fmi2ValueReference reference = known ? knowns[k - n_unknowns] : unknowns[k];
        if (!(known ? is_known(instance, index_of(reference)) : is_unknown(instance, index_of(reference)))) {
            report(instance, fmi2Error, "%s: value reference %u is no %s in this mode (%s)", call->name, reference,
                   known ? "known" : "unknown", phase_name(instance->now.phase));
            return fmi2Error;
        }
    }
    memset(instance->direction, 0, sizeof instance->direction);
    for (size_t k = 0; k < n_knowns; k++) instance->direction[VARIABLES[index_of(knowns[k])].known] += directions[k];
    if (!refresh(instance, 0) || !update_tangent(instance, instance->now.phase == INITIALISING)) {
        report(instance, fmi2Discard, "%s: %s", call->name, no_result(instance));
        return fmi2Discard;
    }
    for (size_t k = 0; k < n_unknowns; k++) {
        int index = VARIABLES[index_of(unknowns[k])].unknown;
        results[k] = index < N_UNKNOWNS ? instance->tangent[index] : instance->direction[N_INPUTS + index - N_UNKNOWNS];
    }
    return fmi2OK;
}
