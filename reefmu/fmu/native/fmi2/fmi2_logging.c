/* Messages to the host, by category. */

/* A call's name, or a status's, as it is in the version of FMI that this is compiled for. */
#ifdef IS_FMI3
#define IN_FMI(two, three) "fmi3" three
#else
#define IN_FMI(two, three) "fmi2" two
#endif

static void log_message(const HostLog *log, fmi2Status status, const char *format, ...) {
    static const struct { fmi2Status status; int bit; const char *name; } categories[] = {
        {fmi2Warning, LOG_WARNING, "logStatusWarning"},
        {fmi2Discard, LOG_DISCARD, "logStatusDiscard"},
        {fmi2Error, LOG_ERROR, "logStatusError"},
        {fmi2Fatal, LOG_FATAL, "logStatusFatal"},
    };
    char message[512], text[2 * sizeof message], *end = text;
    va_list values;
    if (!log->callbacks.logger) return;
    va_start(values, format);
    vsnprintf(message, sizeof message, format, values);
    va_end(values);
    for (const char *from = message; *from; from++) {
#ifndef IS_FMI3
        /* The host takes the message for a format of printf, with #variables# in it (section 2.1.5); what came from
           outside must be neither. "%s" and the message behind it would do for the one, but hosts that do not look
           further, such as FMPy, show "%s". */
        if (*from == '%' || *from == '#') *end++ = *from;
#endif
        *end++ = *from;
    }
    *end = 0;
    for (size_t k = 0; k < sizeof categories / sizeof *categories; k++)
        if (categories[k].status == status && (log->categories & categories[k].bit))
            log->callbacks.logger(log->callbacks.componentEnvironment, log->name, status, categories[k].name,
                                    text);
}

#define log_to_host(instance, ...) log_message(&((const Instance *)(instance))->log, __VA_ARGS__)

/* What is sent with logging off: in FMI 2.0, where that means logging for debugging, why a call was refused; in FMI 3.0
   nothing (section 2.3.1). */
#ifdef IS_FMI3
enum { LOG_OFF = 0 };
#else
enum { LOG_OFF = LOG_ALL & ~LOG_WARNING };
#endif

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
            log_to_host(instance, fmi2Error, IN_FMI("SetDebugLogging", "SetDebugLogging") ": unknown category '%.80s'",
                 chosen[i] ? chosen[i] : "");
            return fmi2Error;
        }
        wanted |= bit;
    }
    if (!count) wanted = LOG_ALL;
    if (on) instance->log.categories = count ? wanted : LOG_ALL;
    else instance->log.categories = count ? instance->log.categories & ~wanted : LOG_OFF;
    return fmi2OK;
}
