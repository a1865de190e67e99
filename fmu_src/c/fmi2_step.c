/* FMI functions: stepping, and what belongs to steps that take a while or interpolate, which these FMUs never do. */

/* Warn once per episode which inputs count as missing. Returns the status of the step. */
static fmi2Status report_missing_inputs(Instance *c) {
    char names[MESSAGE_SIZE];
    size_t n = 0;
    for (int i = 0; i < N_INPUTS && n < sizeof names; i++) {
        if (in_range(&VARIABLES[i], c->state.values[i])) continue;
        n += (size_t)snprintf(names + n, sizeof names - n, "%s%s",
                              n ? ", " : MODEL_NAME ": not finite or out of bounds, treated as missing: ", VARIABLES[i].name);
    }
    bool begins = n > 0 && !c->state.missing;
    c->state.missing = n > 0;
    if (!begins) return fmi2OK;
    warn(c, names);
    return fmi2Warning;
}

fmi2Status fmi2DoStep(fmi2Component component, fmi2Real t, fmi2Real h, fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    Instance *c = instance_of(component);
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!in_phase(c, "fmi2DoStep", STEPPING)) return fmi2Error;
    if (!(isfinite(t) && isfinite(h) && h > 0)) {
        return refuse(c, "cannot step from t = %.15g s by h = %.15g s; h must be positive and finite", t, h);
    }
    if (h > LONGEST_STEP * c->state.values[PERIOD]) {
        return refuse(c, "a step of h = %.15g s is more than %g internal steps", h, LONGEST_STEP);
    }
    fmi2Status status = engine_step(c, t, h);
    if (status != fmi2OK) return status;
    c->state.stale = false;
    return report_missing_inputs(c);
}

static fmi2Status there_is_none(fmi2Component c, const char *reason) {
    return c ? refuse(instance_of(c), "%s", reason) : fmi2Error;
}

fmi2Status fmi2CancelStep(fmi2Component c) { return there_is_none(c, "no step is pending that could be cancelled"); }

#define NEVER_PENDING(function, type)                                              \
    fmi2Status function(fmi2Component c, const fmi2StatusKind kind, type *value) { \
        (void)kind, (void)value;                                                   \
        return c ? fmi2Discard : fmi2Error;                                        \
    }

NEVER_PENDING(fmi2GetStatus, fmi2Status)
NEVER_PENDING(fmi2GetRealStatus, fmi2Real)
NEVER_PENDING(fmi2GetIntegerStatus, fmi2Integer)
NEVER_PENDING(fmi2GetBooleanStatus, fmi2Boolean)
NEVER_PENDING(fmi2GetStringStatus, fmi2String)

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    (void)vr, (void)n, (void)order, (void)value;
    return there_is_none(c, "inputs are held over a step, not interpolated (canInterpolateInputs is false)");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[]) {
    (void)vr, (void)n, (void)order, (void)value;
    return there_is_none(c, "there are no time derivatives of outputs (maxOutputDerivativeOrder is 0)");
}
