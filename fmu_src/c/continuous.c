/* A continuous block: integrated over [t, t + h] with the inputs held, in equal solver steps no longer than max_step.
   Its outputs are those at the end, with the inputs in force there. */

/* Outputs at the present time with the inputs in force. */
static void engine_refresh(Instance *c) {
    const double *arg[N_ARGUMENTS] = {c->state.x, inputs_of(c), parameters_of(c), &c->state.time};
    double *res[N_RESULTS] = {reported_by(c)};
    block_output(arg, res, c->integer_work, c->work, 0);
}

static void engine_initialise(Instance *c) {
    draw(c, 0);
    const double *arg[N_ARGUMENTS] = {parameters_of(c), c->draws};
    double *res[N_RESULTS] = {c->state.x};
    block_initial(arg, res, c->integer_work, c->work, 0);
    c->state.time = c->state.start_time;
    engine_refresh(c);
}

static void advance(Instance *c, double t, double h) {
    const double *arg[N_ARGUMENTS] = {c->state.x, inputs_of(c), parameters_of(c), &t, &h};
    double *res[N_RESULTS] = {c->x_next};
    block_advance(arg, res, c->integer_work, c->work, 0);
    memcpy(c->state.x, c->x_next, sizeof c->x_next);
}

static fmi2Status engine_step(Instance *c, double t, double h) {
    State *s = &c->state;
    double max_step = s->values[PERIOD], time_before = s->time, x_before[N_STATE + 1];
    memcpy(x_before, s->x, sizeof x_before);
    double steps = fmax(1.0, ceil(h / max_step - 1e-9)); /* the fewest; rounding of h does not make one more */
    for (double i = 0; i < steps; i++) advance(c, t + i * (h / steps), h / steps);
    s->time = t + h;
    engine_refresh(c);
    if (all_finite(reported_by(c), N_REPORTED) && all_finite(s->x, N_STATE)) return fmi2OK;
    memcpy(s->x, x_before, sizeof x_before);
    s->time = time_before;
    engine_refresh(c);
    return refuse(
        c, "not finite at t = %.15g s; the solver needs a max_step below %g s, or calmer inputs", t + h, max_step);
}

/* Change dy of the outputs at the present time with a change du of the inputs. */
static void engine_derivative(Instance *c, const double *du, double *dy) {
    const double *arg[N_ARGUMENTS] = {c->state.x, inputs_of(c), parameters_of(c), &c->state.time, du};
    double *res[N_RESULTS] = {dy};
    block_output_derivative(arg, res, c->integer_work, c->work, 0);
}
