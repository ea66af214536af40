/* Which call is allowed in which mode: the tables of FMI 2.0.4, sections 3.2.3 (model exchange) and 4.2.4. */

enum {
    RUNNING = EVENT_MODE | CONTINUOUS_MODE | STEPPING,
    ANYTIME = INSTANTIATED | INITIALISING | RUNNING | TERMINATED
};

typedef struct { const char *name; int phases; } Call;

#define CALL(name, phases) RENAMED(name, #name, phases)
#define RENAMED(name, three, phases) static const Call CALL_##name = {IN_FMI(#name, three), phases}
RENAMED(SetupExperiment, "EnterInitializationMode", INSTANTIATED);
CALL(EnterInitializationMode, INSTANTIATED);
CALL(ExitInitializationMode, INITIALISING);
CALL(Terminate, RUNNING);
CALL(Reset, ANYTIME);
RENAMED(GetReal, "GetFloat64", INITIALISING | RUNNING | TERMINATED);
RENAMED(SetReal, "SetFloat64", INSTANTIATED | INITIALISING | RUNNING);
RENAMED(FMUstate, "FMUState", ANYTIME);
CALL(GetDirectionalDerivative, INITIALISING | RUNNING | TERMINATED);
CALL(DoStep, STEPPING);
CALL(CancelStep, 0); /* steps are never pending */
CALL(GetStatus, STEPPING | TERMINATED);
CALL(EnterEventMode, CONTINUOUS_MODE);
RENAMED(NewDiscreteStates, "UpdateDiscreteStates", EVENT_MODE);
CALL(EnterContinuousTimeMode, EVENT_MODE);
CALL(CompletedIntegratorStep, CONTINUOUS_MODE);
CALL(SetTime, EVENT_MODE | CONTINUOUS_MODE);
CALL(SetContinuousStates, CONTINUOUS_MODE);
RENAMED(GetDerivatives, "GetContinuousStateDerivatives", EVENT_MODE | CONTINUOUS_MODE | TERMINATED);
CALL(GetEventIndicators, INITIALISING | EVENT_MODE | CONTINUOUS_MODE | TERMINATED);
CALL(GetContinuousStates, INITIALISING | EVENT_MODE | CONTINUOUS_MODE | TERMINATED);
CALL(GetNominalsOfContinuousStates, ANYTIME);
#undef CALL
#undef RENAMED

static const char *phase_name(int phase) {
    switch (phase) {
    case INSTANTIATED: return "instantiated";
    case INITIALISING: return "initialization mode";
    case EVENT_MODE: return "event mode";
    case CONTINUOUS_MODE: return "continuous-time mode";
    case STEPPING: return "between two steps";
    default: return "terminated";
    }
}

/* Whether the call is allowed now. An illegal call changes nothing. */
static int allowed(const Instance *instance, const Call *call) {
    if (!instance) return 0;
    if (instance->now.phase & call->phases) return 1;
    report(instance, fmi2Error, "%s: not allowed in this mode (%s)", call->name, phase_name(instance->now.phase));
    return 0;
}

/* The same for a call of one interface type. */
static int allowed_for(const Instance *instance, const Call *call, fmi2Type kind) {
    if (!allowed(instance, call)) return 0;
    if (instance->now.kind == (int)kind) return 1;
    report(instance, fmi2Error, "%s: not allowed in %s", call->name,
           kind == fmi2CoSimulation ? "model exchange" : "co-simulation");
    return 0;
}

/* A time beyond the stop time that the host has set is an error (section 2.1.6; FMI 3.0.2, section 2.3.2).

   ahead: how far an integrator may step beyond it and interpolate. The tolerance of 1e-9, which FMPy and fmusim use as
   well, allows for the rounding of hosts that add up their steps. */
static int before_stop_time(const Instance *instance, const Call *call, double time, double ahead) {
    const InstanceState *now = &instance->now;
    if (!now->stops || time <= now->stop + 1e-9 * fmax(fabs(now->start), fabs(now->stop)) + ahead) return 1;
    report(instance, fmi2Error, "%s: expected a time up to the stop time of %g s, got %.17g s", call->name,
           now->stop, time);
    return 0;
}

/* Whether the host passed an array where `count` elements need one. */
static int has_array(const Instance *instance, const Call *call, const void *array, size_t count) {
    if (array || !count) return 1;
    report(instance, fmi2Error, "%s: expected an array of %lu, got none", call->name, (unsigned long)count);
    return 0;
}

/* The index among the values for a value reference, N_VALUES for an unknown one. In FMI 3.0 the event indicators have
   value references of their own after all others; their values are those of derivatives. */
static size_t index_of(fmi2ValueReference reference) {
    size_t index = (size_t)reference - FIRST_REFERENCE;
#ifdef IS_FMI3
    if (index >= N_VALUES && index < N_VALUES + N_INDICATORS) index += AT_RATES + FIRST_INDICATOR - N_VALUES;
#endif
    return index < N_VALUES ? index : N_VALUES;
}
