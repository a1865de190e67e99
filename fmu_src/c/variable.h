/* What block.c says about each variable and each stream of noise. The value reference of a variable is its place in the table. */

typedef enum { REAL, INTEGER, BOOLEAN } Type;

typedef enum { INPUT, FIXED, TUNABLE, OUTPUT, LOCAL } Role; /* FIXED and TUNABLE are parameters */

typedef struct {
    const char *name;
    const char *unit; /* with a blank before it, for messages; empty for a pure number */
    Type type;
    Role role;
    double start, minimum, maximum;
} Variable;

typedef struct {
    int seed;  /* value reference of the parameter */
    int draws; /* at a time; 0 behind the last stream */
} Stream;
