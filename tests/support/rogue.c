/* An FMU of one output y = t that misbehaves at t = 0.5, in the way that its parameter `fault` says; see rogue.py. */
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);

typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void *finished, *environment;
} Callbacks;

typedef struct {
    double y, u;
    int fault;
    const Callbacks *callbacks;
} Instance;

enum { WARNING = 1, ERROR = 3 };

static void crash(void) { *(volatile int *)0 = 1; }

static void *hang(void *unused) {
    for (;;) usleep(1000);
    return unused;
}

static void say(const Instance *self, int status, const char *text, int number) {
    self->callbacks->logger(self->callbacks->environment, "rogue", status, "", text, number);
}

static void flood(void) {
    for (int i = 0; i < 20000; ++i) {
        printf("line %d of a flood\n", i);
        fprintf(stderr, "line %d of another\n", i);
    }
}

static int step_at_fault(Instance *self) {
    pthread_t thread;
    int child;
    switch (self->fault) {
    case 1: exit(0);
    case 2: exit(3);
    case 3: crash(); break;
    case 4: say(self, ERROR, "the matrix is singular", 0); abort();
    case 5: raise(SIGTERM); break;
    case 6: hang(0); break;
    case 9: pthread_create(&thread, 0, hang, 0); break;
    case 10: return chdir("/") ? ERROR : 0;
    case 11: flood(); break;
    case 12: return -5;
    case 13: return 99;
    case 14: if (fork()) _exit(0); hang(0); break;
    case 15: close(0); close(1); close(2); break;
    case 16: raise(SIGINT); break;
    case 17: if (!(child = fork())) hang(0); say(self, WARNING, "started %d", child); break;
    case 19: for (int file = 3; file < 20; ++file) if (write(file, "garbage, and more of it", 23)) continue; break;
    default: break;
    }
    return 0;
}

void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *resources, const Callbacks *callbacks) {
    Instance *self = calloc(1, sizeof *self);
    (void)name, (void)kind, (void)guid, (void)resources;
    self->callbacks = callbacks;
    return self;
}

void fmi2FreeInstance(Instance *self) {
    if (self->fault == 7) crash();
    if (self->fault == 8) hang(0);
    free(self);
}

int fmi2SetupExperiment(Instance *self, int defined, double tolerance, double start) {
    (void)defined, (void)tolerance;
    self->y = start;
    return 0;
}

int fmi2EnterInitializationMode(Instance *self) { return self->fault == 18 ? -5 : 0; }
int fmi2ExitInitializationMode(Instance *self) { (void)self; return 0; }
int fmi2Terminate(Instance *self) { (void)self; return 0; }

int fmi2DoStep(Instance *self, double t, double h) {
    self->y = t + h;
    return t == 0.5 ? step_at_fault(self) : 0;
}

int fmi2GetReal(Instance *self, const unsigned references[], size_t count, double values[]) {
    for (size_t i = 0; i < count; ++i) values[i] = references[i] ? self->u : self->y;
    return 0;
}

int fmi2SetReal(Instance *self, const unsigned references[], size_t count, const double values[]) {
    (void)references;
    for (size_t i = 0; i < count; ++i) self->u = values[i];
    return 0;
}

int fmi2SetInteger(Instance *self, const unsigned references[], size_t count, const int values[]) {
    (void)references;
    for (size_t i = 0; i < count; ++i) self->fault = values[i];
    return 0;
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }

#define UNUSED(name) int name(void) { return ERROR; }
UNUSED(fmi2SetDebugLogging) UNUSED(fmi2Reset)
UNUSED(fmi2GetInteger) UNUSED(fmi2GetBoolean) UNUSED(fmi2GetString) UNUSED(fmi2SetBoolean) UNUSED(fmi2SetString)
UNUSED(fmi2GetFMUstate) UNUSED(fmi2SetFMUstate) UNUSED(fmi2FreeFMUstate) UNUSED(fmi2SerializedFMUstateSize)
UNUSED(fmi2SerializeFMUstate) UNUSED(fmi2DeSerializeFMUstate) UNUSED(fmi2GetDirectionalDerivative)
UNUSED(fmi2SetRealInputDerivatives) UNUSED(fmi2GetRealOutputDerivatives) UNUSED(fmi2CancelStep) UNUSED(fmi2GetStatus)
UNUSED(fmi2GetRealStatus) UNUSED(fmi2GetIntegerStatus) UNUSED(fmi2GetBooleanStatus) UNUSED(fmi2GetStringStatus)
