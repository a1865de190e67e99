/* One instance: its state, its buffers, its log. */

typedef enum { INSTANTIATED = 1, INITIALISING = 2, STEPPING = 4, TERMINATED = 8 } Phase;

/* Everything that determines the future. Only members of 8 bytes: no padding, so equal states are equal bytes.
   The array sizes have one to spare where they may be zero. */
typedef struct {
    double values[N_VARIABLES]; /* by value reference: inputs, parameters, outputs, locals, sample_time */
    double x[N_STATE + 1];
    double start_time;
    double time;                       /* of a continuous block */
    int64_t next_sample;               /* of a sampled block: this and the next six */
    double reached;                    /* end of the last step */
    double ahead;                      /* samples by which that end is past the instant of the next sample */
    double sampled_from[N_STATE + 1];  /* state before the last sample */
    int64_t began_anew;                /* the last sample counted as the first one */
    int64_t slowly_changed;            /* the last sample changed more of the state than its first N_FAST */
    double sampled_inputs[N_INPUTS + 1]; /* inputs of the last sample */
    int64_t phase;
    int64_t stale;   /* the outputs do not yet follow the inputs and parameters in force */
    int64_t missing; /* in an episode of inputs that count as missing */
} State;

typedef struct {
    State state;
    double x_next[N_STATE + 1];
    double draws[N_NORMALS + 1];
    double work[N_WORK + 1]; /* of the equations: this and the next */
    casadi_int integer_work[N_INTEGER_WORK + 1];
    fmi2CallbackFunctions host;
    bool log_warnings, log_errors;
    char *name; /* of the instance; behind it */
} Instance;

static Instance *instance_of(fmi2Component component) { return (Instance *)component; }

static double *inputs_of(Instance *c) { return c->state.values; }
static double *parameters_of(Instance *c) { return c->state.values + N_INPUTS; }
static double *reported_by(Instance *c) { return c->state.values + N_INPUTS + N_PARAMETERS; }

#if HAS_SOLVER
static bool all_finite(const double *values, int n) {
    for (int i = 0; i < n; i++) {
        if (!isfinite(values[i])) return false;
    }
    return true;
}
#endif

static void to_start_values(State *s) {
    memset(s, 0, sizeof *s);
    for (int i = 0; i < N_VARIABLES; i++) s->values[i] = VARIABLES[i].start;
    s->phase = INSTANTIATED;
    s->stale = true;
}

/* Log categories, as in modelDescription.xml. */
#define LOG_WARNING "logStatusWarning"
#define LOG_ERROR "logStatusError"
#define LOG_FATAL "logStatusFatal" /* nothing here is */
#define LOG_ALL "logAll"

/* Longest message; longer ones, of many wrong parameters, are cut. */
#define MESSAGE_SIZE 2048

/* Hosts take a message for a format of printf. None of ours holds a percent sign: they are made of our own names and of
   numbers, never of text from the host. */
static void report(const fmi2CallbackFunctions *host, const char *instance, fmi2Status status, const char *message) {
    const char *category = status == fmi2Warning ? LOG_WARNING : LOG_ERROR;
    if (host->logger) host->logger(host->componentEnvironment, instance, status, category, message);
}

static void warn(Instance *c, const char *message) {
    if (c->log_warnings) report(&c->host, c->name, fmi2Warning, message);
}

/* Log why a call is refused; the call is to return this. */
static fmi2Status refuse(Instance *c, const char *format, ...) {
    if (c->log_errors) {
        char message[MESSAGE_SIZE];
        int n = snprintf(message, sizeof message, MODEL_NAME ": ");
        va_list values;
        va_start(values, format);
        vsnprintf(message + n, sizeof message - (size_t)n, format, values);
        va_end(values);
        report(&c->host, c->name, fmi2Error, message);
    }
    return fmi2Error;
}
