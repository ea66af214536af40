/* Uniform cubic B-splines: cells and weights. */

typedef struct { double start, per_step; int cells; } Axis;

/* The cell of x (beyond the axis the outermost one), and the coordinate f in it. A NaN gives a NaN coordinate. */
static inline int find_cell(Axis axis, double x, double *f) {
    double u = (x - axis.start) * axis.per_step, last = axis.cells - 1;
    int cell = (int)(u > 0.0 ? (u < last ? u : last) : 0.0);
    *f = u - cell;
    return cell;
}

static inline double clamped(double f) { return f > 0.0 ? (f < 1.0 ? f : 1.0) : f <= 0.0 ? 0.0 : f; }

/* Weights of the four coefficients of a cell at 0 <= c <= 1; below, their first and second derivatives. */
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

/* Weights and slopes at any f: beyond the cell the spline continues as a straight line. */
static inline void cubic_extrapolated(double f, double *w, double *s) {
    double c = clamped(f), beyond = f - c;
    cubic(c, w);
    cubic_slopes(c, s);
    if (beyond != 0.0)
        for (int k = 0; k < 4; k++) w[k] += beyond * s[k];
}

static inline double dot(const double *w, const double *v) {
    return (w[0] * v[0] + w[1] * v[1]) + (w[2] * v[2] + w[3] * v[3]);
}
