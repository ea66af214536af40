/* What the contacts give at a point: torque, stiffness, force, load share. The lookup of the Python model
   (reefmu/tables.py, contact.py and assembly.py), read from the unpacked tables. */

enum { TARGET, CLEARANCE, POSITION };
enum { COMPLIANCE, MISSING, SCALE, BAND };
enum { TORQUE, STIFFNESS, FORCE, SHARE, IN_RANGE };
enum { MEAN, P10, P90, MAX_FORCE, LOAD_SHARE };
enum { NEWTON_STEPS = 8 };
#define SETTLED 1e-10 /* rad: after a Newton step of this size the next is below rounding */

static const Axis TWIST = {0.0, 1.0 / LOOKUP_TWIST_STEP, LOOKUP_TWIST_CELLS};
static const Axis SHIFT = {LOOKUP_CLEARANCE_START, 1.0 / LOOKUP_CLEARANCE_STEP, LOOKUP_CLEARANCE_CELLS};

/* The tables at one clearance and position, as a function of the twist alone; the rows of the last cells. */
typedef struct {
    const Tables *tables; /* NULL: not cut yet */
    const double *tuned;
    double at[N_POINT], shift, held[4];
    int column;
    int cell; /* of the lookup, and the side of the twist */
    double side, rows[4];
#if HAS_ELEMENT
    double element_side, left, around[16];
    int corner, element_cell; /* of the element's table */
    double element_rows[4];
#endif
} Slice;

/* Coefficients along the twist of one quantity. */
static inline double row_of(const Slice *slice, int quantity, int row) {
    return dot(slice->held, slice->tables->lookup + (quantity * LOOKUP_ROWS + row) * LOOKUP_COLUMNS + slice->column);
}

#if HAS_ELEMENT
static const Axis ELEMENT_TWIST = {ELEMENT_TWIST_START, 1.0 / ELEMENT_TWIST_STEP, ELEMENT_TWIST_CELLS};
static const Axis ELEMENT_SHIFT = {ELEMENT_CLEARANCE_START, 1.0 / ELEMENT_CLEARANCE_STEP, ELEMENT_CLEARANCE_CELLS};
static const Axis ELEMENT_PLACE = {ELEMENT_POSITION_START, 1.0 / ELEMENT_POSITION_STEP, ELEMENT_POSITION_CELLS};

/* The missing element's angle to the eccentric, -pi to pi, its side, and how much of the element is left there. */
static double beta_of(double position, double *side, double *left) {
    static const double turn = 6.283185307179586476925;
    double beta = position - turn * floor(position / turn + 0.5), inside;
    *side = beta < 0.0 ? -1.0 : 1.0;
    inside = (ELEMENT_LIMIT - fabs(beta)) / (2.0 * ELEMENT_EDGE) + 0.5;
    *left = clipped(inside);
    return fmin(fabs(beta), ELEMENT_LIMIT + ELEMENT_EDGE);
}

static void cut_element(Slice *slice, const double *q) {
    double g, h, across[4], along[4], beta = beta_of(q[POSITION], &slice->element_side, &slice->left);
    int column, layer;
    slice->element_cell = -1;
    if (slice->tuned[MISSING] == 0.0 || slice->left == 0.0) return;
    column = cell_of(ELEMENT_SHIFT, q[CLEARANCE], &g), layer = cell_of(ELEMENT_PLACE, beta, &h);
    cubic(clipped(g), across);
    cubic(h, along);
    slice->corner = column * ELEMENT_LAYERS + layer;
    for (int b = 0; b < 4; b++)
        for (int d = 0; d < 4; d++) slice->around[4 * b + d] = across[b] * along[d];
}

/* Takes the missing share of the element's torque and stiffness away. */
static void take_element(Slice *slice, double twist, double *torque, double *stiffness) {
    double f, w[4], s[4], lost = slice->tuned[MISSING] * slice->left;
    int cell;
    if (lost == 0.0) return;
    cell = cell_of(ELEMENT_TWIST, slice->element_side * twist, &f);
    if (cell != slice->element_cell) {
        for (int a = 0; a < 4; a++) {
            const double *from = slice->tables->element + (cell + a) * ELEMENT_COLUMNS * ELEMENT_LAYERS + slice->corner;
            double sum = 0.0;
            for (int b = 0; b < 4; b++) sum += dot(slice->around + 4 * b, from + b * ELEMENT_LAYERS);
            slice->element_rows[a] = sum;
        }
        slice->element_cell = cell;
    }
    going_on(f, w, s);
    *torque -= lost * slice->element_side * dot(w, slice->element_rows);
    *stiffness -= lost * dot(s, slice->element_rows) * (1.0 / ELEMENT_TWIST_STEP);
}
#endif

/* For one instance between two changes of its parameters: a slice that is cut there already stays. */
static void cut(Slice *slice, const Tables *tables, const double *tuned, const double *q) {
    if (slice->tables && slice->at[CLEARANCE] == q[CLEARANCE] && slice->at[POSITION] == q[POSITION]) return;
    slice->tables = tables, slice->tuned = tuned;
    slice->at[CLEARANCE] = q[CLEARANCE], slice->at[POSITION] = q[POSITION];
    slice->column = cell_of(SHIFT, q[CLEARANCE], &slice->shift);
    cubic(clipped(slice->shift), slice->held);
    slice->cell = -1, slice->side = 0.0;
#if HAS_ELEMENT
    cut_element(slice, q);
#endif
}

/* Torque and stiffness of the contacts at a twist of their own; f: coordinate in slice->cell. */
static void turn(Slice *slice, double twist, double *f, double *torque, double *stiffness) {
    double side = twist < 0.0 ? -1.0 : 1.0, band = side * slice->tuned[BAND], w[4], s[4];
    int cell = cell_of(TWIST, side * twist, f);
    if (cell != slice->cell || side != slice->side) {
        for (int a = 0; a < 4; a++) {
            double mean = row_of(slice, MEAN, cell + a);
            if (band > 0.0) mean += band * (row_of(slice, P90, cell + a) - mean);
            if (band < 0.0) mean -= band * (row_of(slice, P10, cell + a) - mean);
            slice->rows[a] = mean;
        }
        slice->cell = cell, slice->side = side;
    }
    going_on(*f, w, s);
    *torque = side * dot(w, slice->rows);
    *stiffness = dot(s, slice->rows) * (1.0 / LOOKUP_TWIST_STEP);
#if HAS_ELEMENT
    take_element(slice, twist, torque, stiffness);
#endif
    *torque *= slice->tuned[SCALE], *stiffness *= slice->tuned[SCALE];
}

/* The twist of the contacts at which they and the compliance in series make up the target, from `twist` on; whether
   it was found. */
static int settle(Slice *slice, double target, double *twist) {
    double f, torque, stiffness, step, compliance = slice->tuned[COMPLIANCE];
    for (int k = 0; k < NEWTON_STEPS; k++) {
        turn(slice, *twist, &f, &torque, &stiffness);
        step = (target - *twist - compliance * torque) / (1.0 + compliance * stiffness);
        *twist += step;
        if (fabs(step) <= SETTLED) return 1;
    }
    return 0;
}

/* `contact` at q; where it is known from a point before, the search starts there. */
static void touch(Slice *slice, const double *q, Contact *contact) {
    double f, w[4], s[4], torque, stiffness, rows[4], compliance = slice->tuned[COMPLIANCE], twist = q[TARGET];
    double *c = contact->gives;
    if (compliance != 0.0) {
        if (contact->known)
            twist = contact->twist + (twist - contact->at[TARGET]) * (1.0 - compliance * c[STIFFNESS]);
        if (!settle(slice, q[TARGET], &twist) && contact->known) {
            twist = q[TARGET];
            settle(slice, q[TARGET], &twist);
        }
    }
    turn(slice, twist, &f, &torque, &stiffness);
    if (compliance != 0.0) {
        double softer = 1.0 / (1.0 + compliance * stiffness);
        stiffness *= softer;
        torque -= stiffness * (twist + compliance * torque - q[TARGET]);
    }
    c[TORQUE] = torque, c[STIFFNESS] = stiffness;
    going_on(f, w, s);
    for (int a = 0; a < 4; a++) rows[a] = row_of(slice, MAX_FORCE, slice->cell + a);
    c[FORCE] = slice->tuned[SCALE] * dot(w, rows);
    for (int a = 0; a < 4; a++) rows[a] = row_of(slice, LOAD_SHARE, slice->cell + a);
    c[SHARE] = dot(w, rows);
    c[IN_RANGE] = f <= 1.0 && slice->shift >= 0.0 && slice->shift <= 1.0;
    memcpy(contact->at, q, sizeof contact->at);
    memcpy(contact->tuned, slice->tuned, sizeof contact->tuned);
    contact->twist = twist;
    contact->known = 1;
}
