/* Lower bound of the time of an FMU: the calls of a host's loop without any work, or with one cubic look-up in a table
   (-DTABLE). It does not check its calls as the standard requires. */

#include <stdlib.h>
#include <string.h>

enum { ROWS = 113, COLUMNS = 37 };
typedef struct { double values[128]; double table[ROWS * COLUMNS]; } Bare;

void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *place, const void *calls, int a, int b) {
    Bare *made = calloc(1, sizeof *made);
    (void)name, (void)kind, (void)guid, (void)place, (void)calls, (void)a, (void)b;
    for (int k = 0; k < ROWS * COLUMNS; k++) made->table[k] = k;
    return made;
}
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
/* FMPy looks up every function of the standard. */
#define NOTHING(name) int name(void *made) { (void)made; return 0; }
NOTHING(fmi2Terminate) NOTHING(fmi2Reset) NOTHING(fmi2SetDebugLogging) NOTHING(fmi2CancelStep)
NOTHING(fmi2GetInteger) NOTHING(fmi2GetBoolean) NOTHING(fmi2GetString) NOTHING(fmi2SetInteger)
NOTHING(fmi2SetBoolean) NOTHING(fmi2SetString) NOTHING(fmi2GetFMUstate) NOTHING(fmi2SetFMUstate)
NOTHING(fmi2FreeFMUstate) NOTHING(fmi2SerializedFMUstateSize) NOTHING(fmi2SerializeFMUstate)
NOTHING(fmi2DeSerializeFMUstate) NOTHING(fmi2GetDirectionalDerivative) NOTHING(fmi2SetRealInputDerivatives)
NOTHING(fmi2GetRealOutputDerivatives) NOTHING(fmi2GetStatus) NOTHING(fmi2GetRealStatus)
NOTHING(fmi2GetIntegerStatus) NOTHING(fmi2GetBooleanStatus) NOTHING(fmi2GetStringStatus)
void fmi2FreeInstance(void *made) { free(made); }
int fmi2SetupExperiment(void *made, int a, double b, double c, int d, double e) {
    (void)made, (void)a, (void)b, (void)c, (void)d, (void)e;
    return 0;
}
int fmi2EnterInitializationMode(void *made) { (void)made; return 0; }
int fmi2ExitInitializationMode(void *made) { (void)made; return 0; }

int fmi2SetReal(void *made, const unsigned *references, size_t n, const double *values) {
    for (size_t k = 0; k < n; k++) ((Bare *)made)->values[references[k]] = values[k];
    return 0;
}

int fmi2GetReal(void *made, const unsigned *references, size_t n, double *values) {
    for (size_t k = 0; k < n; k++) values[k] = ((Bare *)made)->values[references[k]];
    return 0;
}

#ifdef TABLE
static void weights(double f, double *w) {
    double g = 1 - f;
    w[0] = g * g * g / 6, w[1] = (4 - 6 * f * f + 3 * f * f * f) / 6;
    w[2] = (4 - 6 * g * g + 3 * g * g * g) / 6, w[3] = f * f * f / 6;
}
#endif

int fmi2DoStep(void *made, double time, double dt, int fixed) {
    (void)time, (void)dt, (void)fixed, (void)made;
#ifdef TABLE
    Bare *b = made;
    double u = (b->values[0] / -29 - b->values[2]) * 1e4 + 55, v = 17.3, wx[4], wy[4], sum = 0;
    int i = (int)u, j = (int)v;
    i = i < 0 ? 0 : i > ROWS - 4 ? ROWS - 4 : i;
    weights(u - i, wx), weights(v - j, wy);
    for (int a = 0; a < 4; a++)
        for (int c = 0; c < 4; c++) sum += wx[a] * wy[c] * b->table[(i + a) * COLUMNS + j + c];
    b->values[5] = sum;
#endif
    return 0;
}
