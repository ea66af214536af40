/* The lookup's tables: how they are packed, and cells and weights of uniform cubic B-splines.

   A table is kept as whole multiples of a quantum, as second differences along the twist and first ones along the
   clearance, odd numbers for negative ones, in planes of bytes: all lowest bytes first. `Tables` holds the numbers
   themselves. */

static void unpack(const uint32_t *words, int planes, const double *quanta, int blocks, int rows, int columns,
                   int layers, double *table) {
    int across = columns * layers;
    long count = (long)blocks * rows * across;
    for (int block = 0; block < blocks; block++)
        for (int inner = 0; inner < across; inner++) {
            int64_t value = 0, rise = 0;
            for (int row = 0; row < rows; row++) {
                long at = ((long)block * rows + row) * across + inner;
                uint64_t code = 0;
                for (int plane = 0; plane < planes; plane++) {
                    long byte = plane * count + at;
                    code |= (uint64_t)(words[byte / 4] >> 8 * (byte % 4) & 255u) << 8 * plane;
                }
                rise += code & 1 ? -(int64_t)(code / 2) - 1 : (int64_t)(code / 2);
                value += rise;
                /* Whole multiples of a power of two: these sums are exact. */
                table[at] = (double)value * quanta[block] + (inner < layers ? 0.0 : table[at - layers]);
            }
        }
}

static void unpack_tables(Tables *tables) {
#if !IS_INDIVIDUAL
    static const double quanta[] = LOOKUP_QUANTA;
    unpack(LOOKUP_WORDS, LOOKUP_PLANES, quanta, LOOKUP_QUANTITIES, LOOKUP_ROWS, LOOKUP_COLUMNS, 1, tables->lookup);
#endif
#if HAS_ELEMENT
    {
        static const double quantum[] = {ELEMENT_QUANTUM};
        unpack(ELEMENT_WORDS, ELEMENT_PLANES, quantum, 1, ELEMENT_ROWS, ELEMENT_COLUMNS, ELEMENT_LAYERS,
               tables->element);
    }
#endif
}

typedef struct { double start, per_step; int cells; } Axis;

/* The cell of x, the outermost beyond the axis, and the coordinate in it. A NaN stays one. */
static inline int cell_of(Axis axis, double x, double *f) {
    double u = (x - axis.start) * axis.per_step, last = axis.cells - 1;
    int cell = (int)(u > 0.0 ? (u < last ? u : last) : 0.0);
    *f = u - cell;
    return cell;
}

static inline double clipped(double f) { return f > 0.0 ? (f < 1.0 ? f : 1.0) : f <= 0.0 ? 0.0 : f; }

/* Weights of the four coefficients of a cell at 0 <= c <= 1, their slopes and curvatures. */
static inline void cubic(double c, double *w) {
    double g = 1.0 - c, cc = c * c, gg = g * g;
    w[0] = gg * g * (1.0 / 6.0), w[3] = cc * c * (1.0 / 6.0);
    w[1] = (4.0 - 6.0 * cc + 3.0 * cc * c) * (1.0 / 6.0), w[2] = (4.0 - 6.0 * gg + 3.0 * gg * g) * (1.0 / 6.0);
}

static inline void cubic_slopes(double c, double *s) {
    double g = 1.0 - c;
    s[0] = -0.5 * g * g, s[3] = 0.5 * c * c;
    s[1] = 0.5 * (3.0 * c - 4.0) * c, s[2] = 0.5 * (4.0 - 3.0 * g) * g;
}

static void cubic_curvatures(double c, double *w) {
    double g = 1.0 - c;
    w[0] = g, w[1] = 3.0 * c - 2.0, w[2] = 3.0 * g - 2.0, w[3] = c;
}

/* The same at any f: beyond the cell in a straight line. */
static inline void cubic_extrapolated(double f, double *w, double *s) {
    double c = clipped(f), beyond = f - c;
    cubic(c, w);
    cubic_slopes(c, s);
    if (beyond != 0.0)
        for (int k = 0; k < 4; k++) w[k] += beyond * s[k];
}

static inline double dot(const double *w, const double *v) { return (w[0] * v[0] + w[1] * v[1]) + (w[2] * v[2] + w[3] * v[3]); }
