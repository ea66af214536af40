/* Messages to the host, by category. */

static void speak(const Voice *voice, fmi2Status status, const char *format, ...) {
    static const struct { fmi2Status status; int bit; const char *name; } categories[] = {
        {fmi2Warning, LOG_WARNING, "logStatusWarning"},
        {fmi2Discard, LOG_DISCARD, "logStatusDiscard"},
        {fmi2Error, LOG_ERROR, "logStatusError"},
        {fmi2Fatal, LOG_FATAL, "logStatusFatal"},
    };
    char text[512];
    va_list values;
    if (!voice->callbacks.logger) return;
    va_start(values, format);
    vsnprintf(text, sizeof text, format, values);
    va_end(values);
    for (size_t k = 0; k < sizeof categories / sizeof *categories; k++)
        if (categories[k].status == status && (voice->log & categories[k].bit))
            voice->callbacks.logger(voice->callbacks.componentEnvironment, voice->name, status, categories[k].name,
                                    text);
}

#define send(instance, ...) speak(&((const Instance *)(instance))->voice, __VA_ARGS__)

/* Off, the log still says why a call was refused: that is no debugging, and there is no other way to learn it. */
FMI2_EXPORT fmi2Status FMI2_NAME(fmi2SetDebugLogging)(fmi2Component component, fmi2Boolean on, size_t count,
                                                      const fmi2String chosen[]) {
    static const char *names[] = {"logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal", "logAll"};
    static const int bits[] = {LOG_WARNING, LOG_DISCARD, LOG_ERROR, LOG_FATAL, LOG_ALL};
    Instance *instance = component;
    int wanted = 0;
    if (!instance || (count && !chosen)) return fmi2Error;
    for (size_t i = 0; i < count; i++) {
        int bit = 0;
        for (size_t k = 0; k < sizeof bits / sizeof *bits; k++)
            if (chosen[i] && strcmp(chosen[i], names[k]) == 0) bit = bits[k];
        if (!bit) {
            send(instance, fmi2Error, "fmi2SetDebugLogging: unknown category '%.80s'", chosen[i] ? chosen[i] : "");
            return fmi2Error;
        }
        wanted |= bit;
    }
    if (!count) wanted = LOG_ALL;
    if (on) instance->voice.log = count ? wanted : LOG_ALL;
    else instance->voice.log = count ? instance->voice.log & ~wanted : LOG_ALL & ~LOG_WARNING;
    return fmi2OK;
}
