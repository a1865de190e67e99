/* A sampled block: takes every instant t_k = start_time + k sample_period in [t, t + h) of a step, with the inputs in
   force, and holds its outputs between. k is a whole number.

   Its clock counts samples, not seconds: a step that begins where the last one ended, as far as times are told apart
   there, goes on from there by h / sample_period samples. So it is exact however far from 0 the start lies. */

static double sample_period(Instance *c) { return c->state.values[PERIOD]; }

static void evaluate_first(Instance *c, double *x) {
    const double *arg[N_ARGUMENTS] = {inputs_of(c), parameters_of(c), c->draws};
    double *res[N_RESULTS] = {x, reported_by(c)};
    block_first(arg, res, c->integer_work, c->work, 0);
}

#if SLOW_STEPS
/* The state is what every sample changes, N_FAST numbers, what slow steps change, and the held inputs, N_HELD. Each
   sample is evaluated in place and touches the second part, by far the largest, only where a slow step is due. */
static double step_of(Instance *c, const double *from, double *x) {
    double due = 0.0;
    const double *arg[N_ARGUMENTS] = {from, inputs_of(c), parameters_of(c), c->draws};
    double *res[N_RESULTS] = {x, x + N_STATE - N_HELD, &due};
    block_step(arg, res, c->integer_work, c->work, 0);
    return due;
}

static void report_of(Instance *c, const double *x, const double *held) {
    const double *arg[N_ARGUMENTS] = {x, held, inputs_of(c), parameters_of(c), c->draws};
    double *res[N_RESULTS] = {reported_by(c)};
    block_report(arg, res, c->integer_work, c->work, 0);
}

static void evaluate_next(Instance *c, const double *from, double *x) {
    const double *held = from + N_STATE - N_HELD;
    double due = step_of(c, from, x);
    c->state.slowly_changed = due != 0.0;
    if (c->state.slowly_changed) {
        const double *arg[N_ARGUMENTS] = {&due, x, held, inputs_of(c), parameters_of(c), c->draws};
        double *res[N_RESULTS] = {c->x_next};
        block_slow(arg, res, c->integer_work, c->work, 0);
        memcpy(x, c->x_next, (N_STATE - N_HELD) * sizeof(double));
    }
    report_of(c, x, held);
}

static void keep_state(State *s) {
    memcpy(s->sampled_from, s->x, N_FAST * sizeof(double));
    memcpy(s->sampled_from + N_STATE - N_HELD, s->x + N_STATE - N_HELD, N_HELD * sizeof(double));
    if (s->slowly_changed) memcpy(s->sampled_from + N_FAST, s->x + N_FAST, (N_STATE - N_HELD - N_FAST) * sizeof(double));
}
#else
static void evaluate_next(Instance *c, const double *from, double *x) {
    const double *arg[N_ARGUMENTS] = {from, inputs_of(c), parameters_of(c), c->draws};
    double *res[N_RESULTS] = {x, reported_by(c)};
    block_next(arg, res, c->integer_work, c->work, 0);
}

static void keep_state(State *s) { memcpy(s->sampled_from, s->x, sizeof s->x); }
#endif

#if BEGINS_ANEW
/* Whether every number that the last sample reports is finite. */
static bool is_sound(Instance *c) {
    double sound = 0.0;
    const double *arg[N_ARGUMENTS] = {reported_by(c)};
    double *res[N_RESULTS] = {&sound};
    block_sound(arg, res, c->integer_work, c->work, 0);
    return sound != 0.0;
}
#endif

static void remember_inputs(State *s) { memcpy(s->sampled_inputs, s->values, N_INPUTS * sizeof(double)); }

/* Instant that the outputs belong to; the start time before the first sample. */
static void stamp(Instance *c) {
    State *s = &c->state;
    double k = s->next_sample > 0 ? (double)(s->next_sample - 1) : 0.0;
    double delay = DELAYED ? reported_by(c)[DELAY_AT] : 0.0;
    s->values[SAMPLE_TIME] = s->start_time + (k * sample_period(c) - delay);
}

/* Outputs as of the first sample if it were taken now; nothing once it was taken. */
static void engine_refresh(Instance *c) {
    if (c->state.next_sample > 0) return;
    draw(c, 0);
    remember_inputs(&c->state);
    evaluate_first(c, c->x_next);
    stamp(c);
}

static void engine_initialise(Instance *c) {
    c->state.next_sample = 0;
    c->state.reached = c->state.start_time;
    c->state.ahead = 0.0;
    engine_refresh(c);
}

/* Take this sample for the first one. */
static void begin(Instance *c) {
    evaluate_first(c, c->state.x);
    c->state.slowly_changed = true;
    c->state.began_anew = true;
}

static void take_sample(Instance *c) {
    State *s = &c->state;
    draw(c, s->next_sample);
    remember_inputs(s);
    keep_state(s);
    if (s->next_sample == 0) {
        begin(c);
    } else {
        s->began_anew = false;
        evaluate_next(c, s->sampled_from, s->x);
    }
#if BEGINS_ANEW
    if (!is_sound(c)) {
        begin(c);
        reported_by(c)[STATUS_AT] += RESTARTED;
    }
#endif
    s->next_sample++;
    stamp(c);
}

/* Samples by which t is past the instant of the next sample. */
static double ahead_at(Instance *c, double t) {
    State *s = &c->state;
    double rounding = TIME_ROUNDING * fmax(fabs(t), fabs(s->start_time));
    if (fabs(t - s->reached) <= rounding) return s->ahead;
    double ahead = (t - s->start_time) / sample_period(c) - (double)s->next_sample;
    double whole = floor(ahead + 0.5);
    return fabs(ahead - whole) * sample_period(c) <= rounding ? whole : ahead;
}

static fmi2Status engine_step(Instance *c, double t, double h) {
    State *s = &c->state;
    double ahead = ahead_at(c, t) + h / sample_period(c);
    if (!(fabs(ahead) <= LONGEST_STEP)) {
        return refuse(c, "t = %.15g s lies more than %g samples away", t, LONGEST_STEP);
    }
#if HAS_SOLVER
    State before = *s;
#endif
    double due = fmax(0.0, ceil(ahead - CLOCK_TOLERANCE));
    for (double i = 0; i < due; i++) take_sample(c);
    s->reached = t + h;
    s->ahead = ahead - due;
#if HAS_SOLVER
    if (!all_finite(reported_by(c), N_REPORTED)) {
        *s = before;
        return refuse(c, "not finite at t = %.15g s; its plant needs a sample_period below %g s, or calmer inputs", t + h,
                      sample_period(c));
    }
#endif
    return fmi2OK;
}

/* Change dy of the outputs of the last sample with a change du of its inputs: exact, at the parameters in force. */
static void engine_derivative(Instance *c, const double *du, double *dy) {
    State *s = &c->state;
    double *res[N_RESULTS] = {dy};
    draw(c, s->next_sample > 0 ? s->next_sample - 1 : 0);
    if (s->next_sample == 0 || s->began_anew) {
        const double *arg[N_ARGUMENTS] = {s->sampled_inputs, parameters_of(c), c->draws, du};
        block_first_derivative(arg, res, c->integer_work, c->work, 0);
    } else {
        const double *arg[N_ARGUMENTS] = {s->sampled_from, s->sampled_inputs, parameters_of(c), c->draws, du};
        block_next_derivative(arg, res, c->integer_work, c->work, 0);
    }
}
