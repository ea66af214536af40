/* What the contacts give at a point: torque, stiffness, force, load share. The lookup of the Python model
   (reefmu/model/contacts), read from the unpacked tables; of an individual, what its own contacts give, generated. */

/* The contacts at one clearance and position, as a function of the twist alone; the rows of the last cells. */
typedef struct {
    const Tables *tables; /* NULL: not cut yet */
    const double *coefficients;
    double at[N_CONTACT_POINT];
#if IS_INDIVIDUAL
    int *integers; /* work space of the generated functions */
    double *work;
#else
    double shift, clearance_weights[4];
    int column;
    int cell; /* of the lookup, and the side of the twist */
    double side, rows[4];
#endif
#if HAS_ELEMENT
    double element_side, remaining, element_weights[16];
    int element_offset, element_cell; /* of the element's table */
    double element_rows[4];
#endif
} Slice;

#if HAS_ELEMENT
static const Axis ELEMENT_TWIST = {ELEMENT_TWIST_START, 1.0 / ELEMENT_TWIST_STEP, ELEMENT_TWIST_CELLS};
static const Axis ELEMENT_SHIFT = {ELEMENT_CLEARANCE_START, 1.0 / ELEMENT_CLEARANCE_STEP, ELEMENT_CLEARANCE_CELLS};
static const Axis ELEMENT_PLACE = {ELEMENT_POSITION_START, 1.0 / ELEMENT_POSITION_STEP, ELEMENT_POSITION_CELLS};

/* The missing element's angle to the eccentric, -pi to pi, its side, and how much of the element is left there. */
static double element_angle(double position, double *side, double *remaining) {
    static const double revolution = 6.283185307179586476925;
    double beta = position - revolution * floor(position / revolution + 0.5), inside;
    *side = beta < 0.0 ? -1.0 : 1.0;
    inside = (ELEMENT_LIMIT - fabs(beta)) / (2.0 * ELEMENT_EDGE) + 0.5;
    *remaining = clipped(inside);
    return fmin(fabs(beta), ELEMENT_LIMIT + ELEMENT_EDGE);
}

static void slice_element_table(Slice *slice, const double *q) {
    double g, h, across[4], along[4], beta = element_angle(q[POSITION], &slice->element_side, &slice->remaining);
    int column, layer;
    slice->element_cell = -1;
    if (slice->coefficients[MISSING] == 0.0 || slice->remaining == 0.0) return;
    column = cell_of(ELEMENT_SHIFT, q[CLEARANCE], &g), layer = cell_of(ELEMENT_PLACE, beta, &h);
    cubic(clipped(g), across);
    cubic(h, along);
    slice->element_offset = column * ELEMENT_LAYERS + layer;
    for (int b = 0; b < 4; b++)
        for (int d = 0; d < 4; d++) slice->element_weights[4 * b + d] = across[b] * along[d];
}

/* Takes the missing share of the element's torque and stiffness away. */
static void subtract_missing_element(Slice *slice, double twist, double *torque, double *stiffness) {
    double f, w[4], s[4], lost = slice->coefficients[MISSING] * slice->remaining;
    int cell;
    if (lost == 0.0) return;
    cell = cell_of(ELEMENT_TWIST, slice->element_side * twist, &f);
    if (cell != slice->element_cell) {
        for (int a = 0; a < 4; a++) {
            const double *from = slice->tables->element + (cell + a) * ELEMENT_COLUMNS * ELEMENT_LAYERS + slice->element_offset;
            double sum = 0.0;
            for (int b = 0; b < 4; b++) sum += dot(slice->element_weights + 4 * b, from + b * ELEMENT_LAYERS);
            slice->element_rows[a] = sum;
        }
        slice->element_cell = cell;
    }
    cubic_extrapolated(f, w, s);
    *torque -= lost * slice->element_side * dot(w, slice->element_rows);
    *stiffness -= lost * dot(s, slice->element_rows) * (1.0 / ELEMENT_TWIST_STEP);
}
#endif

#if !IS_INDIVIDUAL
static const Axis TWIST = {0.0, 1.0 / LOOKUP_TWIST_STEP, LOOKUP_TWIST_CELLS};
static const Axis SHIFT = {LOOKUP_CLEARANCE_START, 1.0 / LOOKUP_CLEARANCE_STEP, LOOKUP_CLEARANCE_CELLS};
#endif

/* For one instance between two changes of its parameters: a slice that is cut there already stays. */
static void update_slice(Slice *slice, const Tables *tables, const double *coefficients, const double *q) {
#if IS_INDIVIDUAL
    slice->at[ANGLE] = q[ANGLE];
#endif
    if (slice->tables && slice->at[CLEARANCE] == q[CLEARANCE] && slice->at[POSITION] == q[POSITION]) return;
    slice->tables = tables, slice->coefficients = coefficients;
    slice->at[CLEARANCE] = q[CLEARANCE], slice->at[POSITION] = q[POSITION];
#if !IS_INDIVIDUAL
    slice->column = cell_of(SHIFT, q[CLEARANCE], &slice->shift);
    cubic(clipped(slice->shift), slice->clearance_weights);
    slice->cell = -1, slice->side = 0.0;
#endif
#if HAS_ELEMENT
    slice_element_table(slice, q);
#endif
}

#if IS_INDIVIDUAL
/* Runs a generated function of the parts at a twist. Beyond this angle, rad, it is lost which element stands where. */
static void evaluate_individual(int (*function)(const double **, double **, int *, double *, int), const Slice *slice,
                     double twist, const double *along, double *result) {
    static const double max_angle = 1e12;
    double point[3] = {twist, slice->at[CLEARANCE], slice->at[ANGLE]};
    const double *arguments[N_ARGUMENTS] = {point, along};
    double *results[N_RESULTS] = {result};
    if (fabs(slice->at[ANGLE]) < max_angle) function(arguments, results, slice->integers, slice->work, 0);
    else for (int k = 0; k < N_CONTACT; k++) result[k] = NAN;
}

/* The contacts at a twist of their own: torque and stiffness, and all that the parts themselves give. */
typedef struct { double torque, stiffness, own[N_CONTACT]; } AtTwist;

static AtTwist tabulated(Slice *slice, double twist) {
    AtTwist at;
    evaluate_individual(individual_contacts, slice, twist, NULL, at.own);
    at.torque = at.own[TORQUE], at.stiffness = at.own[STIFFNESS];
    return at;
}

/* Force, load share and whether the point is in range. */
static void remaining_outputs(const Slice *slice, const AtTwist *at, double *c) {
    (void)slice;
    c[MAX_CONTACT_FORCE] = at->own[MAX_CONTACT_FORCE], c[LOAD_SHARE] = at->own[LOAD_SHARE];
    c[IN_RANGE] = at->own[IN_RANGE];
}
#else
/* Coefficients along the twist of one quantity. */
static inline double row_of(const Slice *slice, int quantity, int row) {
    return dot(slice->clearance_weights, slice->tables->lookup + (quantity * LOOKUP_ROWS + row) * LOOKUP_COLUMNS + slice->column);
}

/* The contacts at a twist of their own: torque and stiffness, and coordinate and weights in slice->cell. */
typedef struct { double torque, stiffness, f, w[4]; } AtTwist;

static AtTwist tabulated(Slice *slice, double twist) {
    AtTwist at;
    double side = twist < 0.0 ? -1.0 : 1.0, band = side * slice->coefficients[BAND], s[4];
    int cell = cell_of(TWIST, side * twist, &at.f);
    if (cell != slice->cell || side != slice->side) {
        for (int a = 0; a < 4; a++) {
            double mean = row_of(slice, TABLE_TORQUE_MEAN, cell + a);
            if (band > 0.0) mean += band * (row_of(slice, TABLE_TORQUE_P90, cell + a) - mean);
            if (band < 0.0) mean -= band * (row_of(slice, TABLE_TORQUE_P10, cell + a) - mean);
            slice->rows[a] = mean;
        }
        slice->cell = cell, slice->side = side;
    }
    cubic_extrapolated(at.f, at.w, s);
    at.torque = side * dot(at.w, slice->rows);
    at.stiffness = dot(s, slice->rows) * (1.0 / LOOKUP_TWIST_STEP);
    return at;
}

/* Force, load share and whether the point is in range. */
static void remaining_outputs(const Slice *slice, const AtTwist *at, double *c) {
    double rows[4];
    for (int a = 0; a < 4; a++) rows[a] = row_of(slice, TABLE_MAX_CONTACT_FORCE, slice->cell + a);
    c[MAX_CONTACT_FORCE] = dot(at->w, rows);
    for (int a = 0; a < 4; a++) rows[a] = row_of(slice, TABLE_LOAD_SHARE, slice->cell + a);
    c[LOAD_SHARE] = dot(at->w, rows);
    c[IN_RANGE] = at->f <= 1.0 && slice->shift >= 0.0 && slice->shift <= 1.0;
}
#endif

/* The same without what is missing and with the modulus of the parameters. */
static AtTwist contacts_at_twist(Slice *slice, double twist) {
    AtTwist at = tabulated(slice, twist);
#if HAS_ELEMENT
    subtract_missing_element(slice, twist, &at.torque, &at.stiffness);
#endif
    at.torque *= slice->coefficients[SCALE], at.stiffness *= slice->coefficients[SCALE];
    return at;
}

/* The twist of the contacts at which they and the compliance in series make up the target, from `twist` on; whether
   it was found. */
static int solve_series_twist(Slice *slice, double target, double *twist) {
    double step, compliance = slice->coefficients[COMPLIANCE];
    for (int k = 0; k < NEWTON_STEPS; k++) {
        AtTwist at = contacts_at_twist(slice, *twist);
        step = (target - *twist - compliance * at.torque) / (1.0 + compliance * at.stiffness);
        *twist += step;
        if (fabs(step) <= NEWTON_TOLERANCE) return 1;
    }
    return 0;
}

/* `contact` at q; where it is known from a point before, the search starts there. */
static void solve_contacts(Slice *slice, const double *q, Contact *contact) {
    double compliance = slice->coefficients[COMPLIANCE], twist = q[TARGET], *c = contact->outputs;
    AtTwist at;
    if (compliance != 0.0) {
        if (contact->known)
            twist = contact->twist + (twist - contact->at[TARGET]) * (1.0 - compliance * c[STIFFNESS]);
        if (!solve_series_twist(slice, q[TARGET], &twist) && contact->known) {
            twist = q[TARGET];
            solve_series_twist(slice, q[TARGET], &twist);
        }
    }
    at = contacts_at_twist(slice, twist);
    c[TORQUE] = at.torque, c[STIFFNESS] = at.stiffness;
    if (compliance != 0.0) {
        c[STIFFNESS] /= 1.0 + compliance * at.stiffness;
        c[TORQUE] -= c[STIFFNESS] * (twist + compliance * at.torque - q[TARGET]);
    }
    remaining_outputs(slice, &at, c);
    c[MAX_CONTACT_FORCE] *= slice->coefficients[SCALE];
    memcpy(contact->at, q, sizeof contact->at);
    memcpy(contact->coefficients, slice->coefficients, sizeof contact->coefficients);
    contact->twist = twist;
    contact->known = 1;
}
