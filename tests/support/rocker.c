/* A platform that rocks about its x axis, angle'' = push[1] + push[2] - stiffness angle; see rocker.py. Compiled with FMI
   as 2 for model exchange, as 3 for model exchange and co-simulation. References below 100 count the elements of `at`. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { OK, WARNING, DISCARD, ERROR };
enum { TIME, ANGLE, RATE, DER_ANGLE, DER_RATE, STIFFNESS, LIMIT, KICK_TIME, PUSH = 10, OMEGA = 12, FORCE = 15, UP = 18,
       QUATERNION = 21, MATRIX = 25, SMALL = 40, HITS = 100, HITS_BEFORE, STEPS, LIFTED, LABEL, CALM, ALL = 64 };

typedef void (*Log3)(void *, int, const char *, const char *);
typedef struct {
    double at[ALL];
    int64_t hits, hits_before;
    uint8_t steps;
    bool kicked, calm;
    char label[100];
    Log3 log;
    void *environment;
} Instance;

static size_t size_of(unsigned reference) {
    switch (reference) {
    case PUSH: return 2;
    case OMEGA: case FORCE: case UP: return 3;
    case QUATERNION: return 4;
    case MATRIX: return 9;
    default: return 1;
    }
}

static void evaluate(Instance *self) {
    double *at = self->at, s = sin(at[ANGLE]), c = cos(at[ANGLE]), g = 9.80665;
    double matrix[9] = {1, 0, 0, 0, c, s, 0, -s, c};  /* N to S */
    at[DER_ANGLE] = at[RATE];
    at[DER_RATE] = at[PUSH] + at[PUSH + 1] - at[STIFFNESS] * at[ANGLE];
    at[OMEGA] = at[RATE];
    at[UP + 1] = s, at[UP + 2] = c;
    at[FORCE + 1] = g * s, at[FORCE + 2] = g * c;
    at[QUATERNION] = cos(at[ANGLE] / 2), at[QUATERNION + 1] = sin(at[ANGLE] / 2);
    memcpy(at + MATRIX, matrix, sizeof matrix);
    at[SMALL] = (float)at[ANGLE];
}

static Instance *fresh(void) {
    Instance *self = calloc(1, sizeof(Instance));
    self->at[STIFFNESS] = 10, self->at[LIMIT] = 10, self->at[ANGLE] = 0.5;
    evaluate(self);
    return self;
}

static int handle_events(Instance *self, bool *next_defined, double *next) {
    double *at = self->at;
    if (fabs(at[ANGLE]) >= at[LIMIT] * (1 - 1e-9) && at[ANGLE] * at[RATE] > 0) at[RATE] = -at[RATE], self->hits++;
    *next_defined = at[KICK_TIME] > 0 && !self->kicked;
    if (*next_defined && at[TIME] >= at[KICK_TIME] - 1e-9) at[RATE] += 1, self->kicked = true, *next_defined = false;
    *next = at[KICK_TIME];
    evaluate(self);
    return OK;
}

static int exact_step(Instance *self, double h) {
    double *at = self->at, w = sqrt(at[STIFFNESS]), rest = (at[PUSH] + at[PUSH + 1]) / at[STIFFNESS];
    double angle = at[ANGLE] - rest, rate = at[RATE];
    at[ANGLE] = rest + angle * cos(w * h) + rate / w * sin(w * h);
    at[RATE] = rate * cos(w * h) - w * angle * sin(w * h);
    self->steps++;
    evaluate(self);
    return OK;
}

#if FMI == 2
#define F(name) fmi2##name
typedef struct { int again, ended, nominals, values, next_defined; double next; } EventInfo;

Instance *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const void *callbacks,
                          int visible, int logging) { return type == 0 ? fresh() : NULL; }
int fmi2SetupExperiment(Instance *self, int has_tolerance, double tolerance, double start, int has_stop, double stop) {
    self->at[TIME] = start;
    return OK;
}
int fmi2EnterInitializationMode(Instance *self) { evaluate(self); return OK; }
int fmi2GetReal(Instance *self, const unsigned *reference, size_t n, double *value) {
    evaluate(self);
    for (size_t i = 0; i < n; ++i) value[i] = self->at[reference[i]];
    return OK;
}
int fmi2SetReal(Instance *self, const unsigned *reference, size_t n, const double *value) {
    for (size_t i = 0; i < n; ++i) self->at[reference[i]] = value[i];
    evaluate(self);
    return OK;
}
int fmi2GetInteger(Instance *self, const unsigned *reference, size_t n, int *value) {
    for (size_t i = 0; i < n; ++i) value[i] = (int)self->hits;
    return OK;
}
int fmi2NewDiscreteStates(Instance *self, EventInfo *info) {
    bool next;
    memset(info, 0, sizeof *info);
    int status = handle_events(self, &next, &info->next);
    info->next_defined = next;
    return status;
}
int fmi2CompletedIntegratorStep(Instance *self, int no_way_back, int *event, int *ended) {
    *event = *ended = 0;
    return OK;
}
#else
#define F(name) fmi3##name

static Instance *instance3(void *environment, Log3 log) {
    Instance *self = fresh();
    self->environment = environment, self->log = log;
    return self;
}
Instance *fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, bool visible,
                                       bool logging, void *environment, Log3 log) { return instance3(environment, log); }
Instance *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                      bool logging, bool events, bool early, const unsigned *required, size_t n,
                                      void *environment, Log3 log, void *update) { return instance3(environment, log); }
int fmi3EnterInitializationMode(Instance *self, bool has_tolerance, double tolerance, double start, bool has_stop,
                                double stop) {
    self->at[TIME] = start;
    self->hits = self->hits_before;
    if (self->label[0]) self->log(self->environment, WARNING, "", self->label);
    evaluate(self);
    return OK;
}
int fmi3GetFloat64(Instance *self, const unsigned *reference, size_t n, double *value, size_t size) {
    evaluate(self);
    for (size_t i = 0; i < n; value += size_of(reference[i++]))
        memcpy(value, self->at + reference[i], size_of(reference[i]) * sizeof *value);
    return OK;
}
int fmi3SetFloat64(Instance *self, const unsigned *reference, size_t n, const double *value, size_t size) {
    for (size_t i = 0; i < n; value += size_of(reference[i++])) {
        memcpy(self->at + reference[i], value, size_of(reference[i]) * sizeof *value);
        size -= size_of(reference[i]);
    }
    evaluate(self);
    return size ? ERROR : OK;  /* an array has to come whole */
}
int fmi3GetFloat32(Instance *self, const unsigned *reference, size_t n, float *value, size_t size) {
    for (size_t i = 0; i < n; ++i) value[i] = (float)self->at[reference[i]];
    return OK;
}
int fmi3GetInt64(Instance *self, const unsigned *reference, size_t n, int64_t *value, size_t size) {
    for (size_t i = 0; i < n; ++i) value[i] = reference[i] == HITS ? self->hits : self->hits_before;
    return OK;
}
int fmi3SetInt64(Instance *self, const unsigned *reference, size_t n, const int64_t *value, size_t size) {
    for (size_t i = 0; i < n; ++i) self->hits_before = value[i];
    return OK;
}
int fmi3GetUInt8(Instance *self, const unsigned *reference, size_t n, uint8_t *value, size_t size) {
    for (size_t i = 0; i < n; ++i) value[i] = self->steps;
    return OK;
}
int fmi3SetUInt8(Instance *self, const unsigned *reference, size_t n, const uint8_t *value, size_t size) {
    for (size_t i = 0; i < n; ++i) self->steps = value[i];
    return OK;
}
int fmi3GetBoolean(Instance *self, const unsigned *reference, size_t n, bool *value, size_t size) {
    for (size_t i = 0; i < n; ++i) value[i] = reference[i] == CALM ? self->calm : self->at[ANGLE] > 0;
    return OK;
}
int fmi3SetBoolean(Instance *self, const unsigned *reference, size_t n, const bool *value, size_t size) {
    for (size_t i = 0; i < n; ++i) self->calm = value[i];
    return OK;
}
int fmi3SetString(Instance *self, const unsigned *reference, size_t n, const char *const *value, size_t size) {
    strncpy(self->label, value[0], sizeof self->label - 1);
    return OK;
}
int fmi3DoStep(Instance *self, double time, double h, bool no_way_back, bool *event, bool *ended, bool *early,
               double *reached) {
    exact_step(self, self->calm ? 0 : h);
    *event = false, *early = self->at[STIFFNESS] == 96, *reached = self->at[TIME] = time + h;
    *ended = fabs(self->at[ANGLE]) > self->at[LIMIT];
    return OK;
}
int fmi3UpdateDiscreteStates(Instance *self, bool *again, bool *ended, bool *nominals, bool *values, bool *next_defined,
                             double *next) {
    *again = *ended = *nominals = *values = false;
    return handle_events(self, next_defined, next);
}
int fmi3CompletedIntegratorStep(Instance *self, bool no_way_back, bool *event, bool *ended) {
    *event = *ended = false;
    return OK;
}
#endif

int F(ExitInitializationMode)(Instance *self) { return OK; }
int F(EnterEventMode)(Instance *self) { return OK; }
int F(EnterContinuousTimeMode)(Instance *self) { return OK; }
int F(SetTime)(Instance *self, double time) { self->at[TIME] = time; return OK; }
int F(SetContinuousStates)(Instance *self, const double *x, size_t n) {
    memcpy(self->at + ANGLE, x, 2 * sizeof *x);
    return OK;
}
int F(GetContinuousStates)(Instance *self, double *x, size_t n) {
    memcpy(x, self->at + ANGLE, 2 * sizeof *x);
    return OK;
}
int F(GetNominalsOfContinuousStates)(Instance *self, double *x, size_t n) { x[0] = x[1] = 1; return OK; }
static int derivatives(Instance *self, double *x) {
    evaluate(self);
    memcpy(x, self->at + DER_ANGLE, 2 * sizeof *x);
    if (self->at[STIFFNESS] == 98) abort();
    while (self->at[STIFFNESS] == 97);
    return self->at[STIFFNESS] == 99 ? ERROR : OK;
}
#if FMI == 2
int fmi2GetDerivatives(Instance *self, double *x, size_t n) { return derivatives(self, x); }
#else
int fmi3GetContinuousStateDerivatives(Instance *self, double *x, size_t n) { return derivatives(self, x); }
#endif
int F(GetEventIndicators)(Instance *self, double *z, size_t n) {
    z[0] = self->at[LIMIT] - fabs(self->at[ANGLE]);
    return OK;
}
int F(Terminate)(Instance *self) { return OK; }
void F(FreeInstance)(Instance *self) { free(self); }

/* What FMPy wants to find and nobody calls. */
#define X(name) int name(void) { return ERROR; }
#include "unused.h"
