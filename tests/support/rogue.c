/* An FMU of one output y = t that misbehaves in the way its parameter `fault` says, from t = 0.5 on. */
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct { Logger logger; void *(*allocate)(size_t, size_t); void (*release)(void *); void *finished; void *environment; } Callbacks;
typedef struct { double y, u; int fault; const Callbacks *callbacks; } Instance;

static void *idle(void *unused) {
    for (;;) usleep(1000);
    return unused;
}

static void misbehave(Instance *self) {
    pthread_t thread;
    switch (self->fault) {
    case 1: exit(0);
    case 2: exit(3);
    case 3: *(volatile int *)0 = 1; break;
    case 4: self->callbacks->logger(self->callbacks->environment, "rogue", 3, "", "the matrix is singular"); abort();
    case 5: raise(SIGTERM); break;
    case 6: for (;;) usleep(1000);
    case 9: pthread_create(&thread, 0, idle, 0); break;
    case 10: if (chdir("/")) abort(); break;
    case 11: for (int i = 0; i < 20000; ++i) { printf("a line of a flood %d\n", i); fprintf(stderr, "another one %d\n", i); } break;
    case 14: if (fork()) _exit(0); for (;;) usleep(1000);
    case 15: close(0); close(1); close(2); break;
    case 16: raise(SIGINT); break;
    case 17: if (!fork()) { for (;;) usleep(1000); } break;
    default: break;
    }
}

void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *resources, const Callbacks *callbacks, int visible, int logging) {
    Instance *self = calloc(1, sizeof *self);
    (void)name; (void)kind; (void)guid; (void)resources; (void)visible; (void)logging;
    self->callbacks = callbacks;
    return self;
}
void fmi2FreeInstance(Instance *self) {
    if (self->fault == 7) *(volatile int *)0 = 1;
    if (self->fault == 8) for (;;) usleep(1000);
    free(self);
}
int fmi2SetupExperiment(Instance *self, int a, double b, double start, int c, double d) { (void)a; (void)b; (void)c; (void)d; self->y = start; return 0; }
int fmi2EnterInitializationMode(Instance *self) { return self->fault == 18 ? -5 : 0; }
int fmi2ExitInitializationMode(Instance *self) { (void)self; return 0; }
int fmi2Terminate(Instance *self) { (void)self; return 0; }
int fmi2DoStep(Instance *self, double t, double h, int unused) {
    (void)unused;
    if (t == 0.5) misbehave(self);
    if (t == 0.5 && self->fault == 12) return -5;
    if (t == 0.5 && self->fault == 13) return 99;
    self->y = t + h;
    return 0;
}
int fmi2GetReal(Instance *self, const unsigned r[], size_t n, double v[]) { for (size_t i = 0; i < n; ++i) v[i] = r[i] ? self->u : self->y; return 0; }
int fmi2SetReal(Instance *self, const unsigned r[], size_t n, const double v[]) { (void)r; for (size_t i = 0; i < n; ++i) self->u = v[i]; return 0; }
int fmi2SetInteger(Instance *self, const unsigned r[], size_t n, const int v[]) { (void)r; for (size_t i = 0; i < n; ++i) self->fault = v[i]; return 0; }
#define UNUSED(name) int name(void) { return 3; }
UNUSED(fmi2GetInteger) UNUSED(fmi2GetBoolean) UNUSED(fmi2GetString) UNUSED(fmi2SetBoolean) UNUSED(fmi2SetString)
UNUSED(fmi2Reset) UNUSED(fmi2GetFMUstate) UNUSED(fmi2SetFMUstate) UNUSED(fmi2FreeFMUstate) UNUSED(fmi2SerializedFMUstateSize)
UNUSED(fmi2SerializeFMUstate) UNUSED(fmi2DeSerializeFMUstate) UNUSED(fmi2GetDirectionalDerivative) UNUSED(fmi2SetRealInputDerivatives)
UNUSED(fmi2GetRealOutputDerivatives) UNUSED(fmi2CancelStep) UNUSED(fmi2GetStatus) UNUSED(fmi2GetRealStatus) UNUSED(fmi2GetIntegerStatus)
UNUSED(fmi2GetBooleanStatus) UNUSED(fmi2GetStringStatus) UNUSED(fmi2SetDebugLogging)
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
