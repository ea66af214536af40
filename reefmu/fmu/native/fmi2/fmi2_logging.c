/* Messages to the host, by category. */

/* The name of a function or status in the version of FMI for which this file is compiled. */
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
        /* The host may take the message for a format string of printf with #references# in it (section 2.1.5), so both
           characters are doubled. Passing "%s" with the message as argument would also be correct, but hosts that
           do not expand formats, such as FMPy, would show "%s". */
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

#define report(instance, ...) log_message(&((const Instance *)(instance))->log, __VA_ARGS__)

/* The categories that are sent with logging off. In FMI 2.0, where loggingOn concerns debugging, these are the reasons
   of refused calls; in FMI 3.0 none (section 2.3.1). */
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
            report(instance, fmi2Error, IN_FMI("SetDebugLogging", "SetDebugLogging") ": unknown category '%.80s'",
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
