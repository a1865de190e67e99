/* FMI functions: versions, an instance's life from fmi2Instantiate to fmi2FreeInstance, its log. */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

static fmi2Component cannot_instantiate(const fmi2CallbackFunctions *host, const char *name, const char *message) {
    if (host) report(host, name ? name : "", fmi2Error, message);
    return NULL;
}

/* Errors are logged whether logging is on or not: the host has asked for something it does not get. */
fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean loggingOn) {
    (void)resources, (void)visible; /* there are neither resources nor a window */
    if (!instanceName || !instanceName[0]) {
        return cannot_instantiate(functions, instanceName, MODEL_NAME ": an instance needs a name");
    }
    if (fmuType != fmi2CoSimulation) {
        return cannot_instantiate(functions, instanceName, MODEL_NAME ": for co-simulation only");
    }
    if (!fmuGUID || strcmp(fmuGUID, MODEL_GUID) != 0) {
        return cannot_instantiate(functions, instanceName,
                                  MODEL_NAME ": the GUID is not " MODEL_GUID
                                             "; modelDescription.xml and binary are of different builds");
    }
    size_t name_size = strlen(instanceName) + 1;
    Instance *c = (Instance *)calloc(1, sizeof *c + name_size);
    if (!c) return cannot_instantiate(functions, instanceName, MODEL_NAME ": out of memory");
    c->name = (char *)(c + 1);
    memcpy(c->name, instanceName, name_size);
    if (functions) c->host = *functions;
    c->log_warnings = loggingOn;
    c->log_errors = true;
    to_start_values(&c->state);
    return c;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

/* Switch the named categories, or all of them if none is named; switching some on switches the others off. */
fmi2Status fmi2SetDebugLogging(fmi2Component component, fmi2Boolean loggingOn, size_t n, const fmi2String categories[]) {
    Instance *c = instance_of(component);
    if (!c || !is_given(c, "fmi2SetDebugLogging", categories, n)) return fmi2Error;
    bool warnings = n == 0, errors = n == 0;
    for (size_t i = 0; i < n; i++) {
        bool all = categories[i] && strcmp(categories[i], LOG_ALL) == 0;
        bool warning = categories[i] && strcmp(categories[i], LOG_WARNING) == 0;
        bool error = categories[i] && strcmp(categories[i], LOG_ERROR) == 0;
        bool fatal = categories[i] && strcmp(categories[i], LOG_FATAL) == 0;
        if (!all && !warning && !error && !fatal) {
            return refuse(c, "there is no such log category; there are " LOG_WARNING ", " LOG_ERROR ", " LOG_FATAL
                             " and " LOG_ALL);
        }
        warnings = warnings || all || warning;
        errors = errors || all || error;
    }
    c->log_warnings = loggingOn ? warnings : c->log_warnings && !warnings;
    c->log_errors = loggingOn ? errors : c->log_errors && !errors;
    return fmi2OK;
}

/* The end of the experiment and a tolerance change nothing here. */
fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean toleranceDefined, fmi2Real tolerance,
                               fmi2Real startTime, fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    Instance *c = instance_of(component);
    (void)toleranceDefined, (void)tolerance, (void)stopTimeDefined, (void)stopTime;
    if (!in_phase(c, "fmi2SetupExperiment", INSTANTIATED)) return fmi2Error;
    if (!isfinite(startTime)) return refuse(c, "start time %g is not a time", startTime);
    c->state.start_time = startTime;
    return fmi2OK;
}

static fmi2Status move(Instance *c, const char *function, int from, int to) {
    if (!in_phase(c, function, from)) return fmi2Error;
    c->state.phase = to;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return move(instance_of(c), "fmi2EnterInitializationMode", INSTANTIATED, INITIALISING);
}

/* With a parameter out of its range the instance stays in initialisation mode: the host may correct it. */
fmi2Status fmi2ExitInitializationMode(fmi2Component component) {
    Instance *c = instance_of(component);
    if (!in_phase(c, "fmi2ExitInitializationMode", INITIALISING)) return fmi2Error;
    if (!parameters_are_good(c)) {
        char problems[MESSAGE_SIZE];
        describe_bad_parameters(c, problems, sizeof problems);
        return refuse(c, "%s", problems);
    }
    engine_initialise(c);
    c->state.phase = STEPPING;
    c->state.stale = false;
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) {
    return move(instance_of(c), "fmi2Terminate", STEPPING, TERMINATED);
}

fmi2Status fmi2Reset(fmi2Component component) {
    Instance *c = instance_of(component);
    if (!c) return fmi2Error;
    to_start_values(&c->state);
    return fmi2OK;
}
