/* Directional derivatives (FMI 2.0.4, section 2.1.9), states held.

   Knowns: inputs and states. Unknowns: outputs and derivatives. At initialisation the states follow the inputs;
   their part is left out there, as in `stiffness`. */

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetDirectionalDerivative)(
    fmi2Component component, const fmi2ValueReference unknowns[], size_t n_unknowns, const fmi2ValueReference knowns[],
    size_t n_knowns, const fmi2Real directions[], fmi2Real results[]) {
    Instance *instance = component;
    const Call *call = &CALL_GetDirectionalDerivative;
    if (!allowed(instance, call) || !given(instance, call, unknowns, n_unknowns) ||
        !given(instance, call, knowns, n_knowns) || !given(instance, call, directions, n_knowns) ||
        !given(instance, call, results, n_unknowns))
        return fmi2Error;
    for (size_t k = 0; k < n_unknowns + n_knowns; k++) {
        int is_known = k >= n_unknowns;
        fmi2ValueReference reference = is_known ? knowns[k - n_unknowns] : unknowns[k];
        size_t place = place_of(reference);
        if (place == N_VALUES || (is_known ? VARIABLES[place].known : VARIABLES[place].unknown) < 0) {
            send(instance, fmi2Error, IN_FMI("GetDirectionalDerivative", "GetDirectionalDerivative") ": value reference %u is no %s", reference,
                 is_known ? "input or state" : "output or derivative");
            return fmi2Error;
        }
    }
    memset(instance->direction, 0, sizeof instance->direction);
    for (size_t k = 0; k < n_knowns; k++) instance->direction[VARIABLES[place_of(knowns[k])].known] += directions[k];
    if (!refresh(instance, 0) || !tangent(instance)) {
        send(instance, fmi2Discard, IN_FMI("GetDirectionalDerivative", "GetDirectionalDerivative") ": no finite result with these inputs and parameters");
        return fmi2Discard;
    }
    for (size_t k = 0; k < n_unknowns; k++) results[k] = instance->tangent[VARIABLES[place_of(unknowns[k])].unknown];
    return fmi2OK;
}
