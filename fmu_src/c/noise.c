/* Seeded uniform draws, the same as imufmu.noise.uniforms: SplitMix64 (Steele, Lea, Flood, OOPSLA 2014,
   doi:10.1145/2660193.2660195). Their way to normal draws is part of the equations. */

static const uint64_t STRIDE = 0x9E3779B97F4A7C15u;

static uint64_t mix(uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

/* Draw the noise of sample k: numbers in (0, 1) that are a pure function of each stream's seed and k. */
static void draw(Instance *c, int64_t k) {
    double *next = c->draws;
    for (const Stream *stream = STREAMS; stream->draws > 0; stream++) {
        uint64_t start = mix((uint64_t)(int64_t)c->state.values[stream->seed] + STRIDE);
        for (int j = 0; j < stream->draws; j++) {
            uint64_t index = (uint64_t)k * (uint64_t)stream->draws + (uint64_t)j;
            uint64_t z = mix(start + (index + 1) * STRIDE);
            *next++ = ((double)(z >> 12) + 0.5) * (1.0 / 4503599627370496.0); /* 2^52: 52 bits and a half: never 0, never 1 */
        }
    }
}
