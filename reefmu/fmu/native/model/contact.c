/* The outputs of the contacts at a contact point: torque, stiffness, force, load share. They come from the decoded
   tables, as in reefmu/model/contacts, or, for an individual and a curve, from a generated function. */

/* The tables at one clearance and position, as functions of the twist alone. The coefficients of the cell that was used
   last are kept, because Newton's method and successive steps mostly stay within a cell. */
typedef struct {
    const Tables *tables; /* NULL: not set yet */
    const double *coefficients;
    double point[N_CONTACT_POINT];
#if HAS_CONTACT_FUNCTION
    int *integers; /* work space of the generated functions */
    double *work;
#else
    double clearance_offset, clearance_weights[4];
    int column;
    int cell;
    double sign, rows[4]; /* of the twist, and the coefficients of the cell along the twist */
#endif
#if HAS_ELEMENT
    double element_sign, element_fraction, element_weights[16];
    int element_offset, element_cell;
    double element_rows[4];
#endif
} Slice;

#if HAS_ELEMENT
static const Axis ELEMENT_TWIST_AXIS = {ELEMENT_TWIST_START, 1.0 / ELEMENT_TWIST_STEP, ELEMENT_TWIST_CELLS};
static const Axis ELEMENT_CLEARANCE_AXIS = {ELEMENT_CLEARANCE_START, 1.0 / ELEMENT_CLEARANCE_STEP,
                                            ELEMENT_CLEARANCE_CELLS};
static const Axis ELEMENT_POSITION_AXIS = {ELEMENT_POSITION_START, 1.0 / ELEMENT_POSITION_STEP,
                                           ELEMENT_POSITION_CELLS};

/* Absolute value and sign of the missing element's angle to the eccentric, -pi to pi, and the fraction of its table's
   values to use, which falls to 0 at the edge of the usable profile. */
static double element_angle(double position, double *sign, double *fraction) {
    static const double revolution = 6.283185307179586476925;
    double beta = position - revolution * floor(position / revolution + 0.5), inside;
    *sign = beta < 0.0 ? -1.0 : 1.0;
    inside = (ELEMENT_LIMIT - fabs(beta)) / (2.0 * ELEMENT_EDGE) + 0.5;
    *fraction = clamped(inside);
    return fmin(fabs(beta), ELEMENT_LIMIT + ELEMENT_EDGE);
}

static void slice_element_table(Slice *slice, const double *q) {
    double g, h, clearance_weights[4], position_weights[4];
    double beta = element_angle(q[POSITION], &slice->element_sign, &slice->element_fraction);
    int column, layer;
    slice->element_cell = -1;
    if (slice->coefficients[MISSING] == 0.0 || slice->element_fraction == 0.0) return;
    column = find_cell(ELEMENT_CLEARANCE_AXIS, q[CLEARANCE], &g), layer = find_cell(ELEMENT_POSITION_AXIS, beta, &h);
    cubic(clamped(g), clearance_weights);
    cubic(h, position_weights);
    slice->element_offset = column * ELEMENT_LAYERS + layer;
    for (int b = 0; b < 4; b++)
        for (int d = 0; d < 4; d++) slice->element_weights[4 * b + d] = clearance_weights[b] * position_weights[d];
}

/* Subtracts the missing share of one element's torque and stiffness. */
static void subtract_missing_element(Slice *slice, double twist, double *torque, double *stiffness) {
    double f, w[4], s[4], missing = slice->coefficients[MISSING] * slice->element_fraction;
    int cell;
    if (missing == 0.0) return;
    cell = find_cell(ELEMENT_TWIST_AXIS, slice->element_sign * twist, &f);
    if (cell != slice->element_cell) {
        for (int a = 0; a < 4; a++) {
            const double *from =
                slice->tables->element + (cell + a) * ELEMENT_COLUMNS * ELEMENT_LAYERS + slice->element_offset;
            double sum = 0.0;
            for (int b = 0; b < 4; b++) sum += dot(slice->element_weights + 4 * b, from + b * ELEMENT_LAYERS);
            slice->element_rows[a] = sum;
        }
        slice->element_cell = cell;
    }
    cubic_extrapolated(f, w, s);
    *torque -= missing * slice->element_sign * dot(w, slice->element_rows);
    *stiffness -= missing * dot(s, slice->element_rows) * (1.0 / ELEMENT_TWIST_STEP);
}
#endif

#if !HAS_CONTACT_FUNCTION
static const Axis TWIST_AXIS = {0.0, 1.0 / LOOKUP_TWIST_STEP, LOOKUP_TWIST_CELLS};
static const Axis CLEARANCE_AXIS = {LOOKUP_CLEARANCE_START, 1.0 / LOOKUP_CLEARANCE_STEP, LOOKUP_CLEARANCE_CELLS};
#endif

/* Sets the slice to a contact point, unless it is there already. The tables and coefficients of an instance are the
   same for all calls with one slice. */
static void update_slice(Slice *slice, const Tables *tables, const double *coefficients, const double *q) {
#if HAS_ANGLE
    slice->point[ANGLE] = q[ANGLE];
#endif
    if (slice->tables && slice->point[CLEARANCE] == q[CLEARANCE] && slice->point[POSITION] == q[POSITION]) return;
    slice->tables = tables, slice->coefficients = coefficients;
    slice->point[CLEARANCE] = q[CLEARANCE], slice->point[POSITION] = q[POSITION];
#if !HAS_CONTACT_FUNCTION
    slice->column = find_cell(CLEARANCE_AXIS, q[CLEARANCE], &slice->clearance_offset);
    cubic(clamped(slice->clearance_offset), slice->clearance_weights);
    slice->cell = -1, slice->sign = 0.0;
#endif
#if HAS_ELEMENT
    slice_element_table(slice, q);
#endif
}

#if HAS_CONTACT_FUNCTION
/* Runs a generated function of the contacts at a twist. Beyond max_angle, rad, the output angle is too coarse to locate
   the elements of an individual. */
static void evaluate_contact_function(int (*function)(const double **, double **, int *, double *, int),
                                      const Slice *slice, double twist, const double *along, double *result) {
    static const double max_angle = 1e12;
#if HAS_ANGLE
    double angle = slice->point[ANGLE];
#else
    double angle = 0.0;
#endif
    double point[3] = {twist, slice->point[CLEARANCE], angle};
    const double *arguments[N_ARGUMENTS] = {point, along};
    double *results[N_RESULTS] = {result};
    if (fabs(angle) < max_angle) function(arguments, results, slice->integers, slice->work, 0);
    else for (int k = 0; k < N_CONTACT; k++) result[k] = NAN;
}

/* The contacts at a twist of the contacts alone: torque and stiffness, and all outputs of the generated function. */
typedef struct { double torque, stiffness, outputs[N_CONTACT]; } AtTwist;

static AtTwist tabulated(Slice *slice, double twist) {
    AtTwist at;
    evaluate_contact_function(contact_function, slice, twist, NULL, at.outputs);
    at.torque = at.outputs[TORQUE], at.stiffness = at.outputs[STIFFNESS];
    return at;
}

/* Sets force, load share and whether the contact point is within the range of the tables. */
static void remaining_outputs(const Slice *slice, const AtTwist *at, double *c) {
    (void)slice;
    c[MAX_CONTACT_FORCE] = at->outputs[MAX_CONTACT_FORCE], c[LOAD_SHARE] = at->outputs[LOAD_SHARE];
    c[IN_RANGE] = at->outputs[IN_RANGE];
}
#else
/* One coefficient along the twist, of a quantity at the clearance of the slice. */
static inline double row_of(const Slice *slice, int quantity, int row) {
    return dot(slice->clearance_weights,
               slice->tables->lookup + (quantity * LOOKUP_ROWS + row) * LOOKUP_COLUMNS + slice->column);
}

/* The contacts at a twist of the contacts alone: torque and stiffness, and coordinate and weights in slice->cell. */
typedef struct { double torque, stiffness, f, w[4]; } AtTwist;

static AtTwist tabulated(Slice *slice, double twist) {
    AtTwist at;
    double sign = twist < 0.0 ? -1.0 : 1.0, band = sign * slice->coefficients[BAND], s[4];
    int cell = find_cell(TWIST_AXIS, sign * twist, &at.f);
    if (cell != slice->cell || sign != slice->sign) {
        for (int a = 0; a < 4; a++) {
            double mean = row_of(slice, TABLE_TORQUE_MEAN, cell + a);
            if (band > 0.0) mean += band * (row_of(slice, TABLE_TORQUE_P90, cell + a) - mean);
            if (band < 0.0) mean -= band * (row_of(slice, TABLE_TORQUE_P10, cell + a) - mean);
            slice->rows[a] = mean;
        }
        slice->cell = cell, slice->sign = sign;
    }
    cubic_extrapolated(at.f, at.w, s);
    at.torque = sign * dot(at.w, slice->rows);
    at.stiffness = dot(s, slice->rows) * (1.0 / LOOKUP_TWIST_STEP);
    return at;
}

/* Sets force, load share and whether the contact point is within the range of the tables. */
static void remaining_outputs(const Slice *slice, const AtTwist *at, double *c) {
    double rows[4];
    for (int a = 0; a < 4; a++) rows[a] = row_of(slice, TABLE_MAX_CONTACT_FORCE, slice->cell + a);
    c[MAX_CONTACT_FORCE] = dot(at->w, rows);
    for (int a = 0; a < 4; a++) rows[a] = row_of(slice, TABLE_LOAD_SHARE, slice->cell + a);
    c[LOAD_SHARE] = dot(at->w, rows);
    c[IN_RANGE] = at->f <= 1.0 && slice->clearance_offset >= 0.0 && slice->clearance_offset <= 1.0;
}
#endif

/* The same less the missing element, scaled for the modulus. */
static AtTwist contacts_at_twist(Slice *slice, double twist) {
    AtTwist at = tabulated(slice, twist);
#if HAS_ELEMENT
    subtract_missing_element(slice, twist, &at.torque, &at.stiffness);
#endif
    at.torque *= slice->coefficients[SCALE], at.stiffness *= slice->coefficients[SCALE];
    return at;
}

/* Newton's method for the twist of the contacts at which it and the deflection of the compliance in series add up to
   `target`, from the start value *twist. Returns whether it converged. */
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

/* Sets `contact` to the solution at the contact point q. A known solution at another point gives the start value. */
static void solve_contacts(Slice *slice, const double *q, Contact *contact) {
    double compliance = slice->coefficients[COMPLIANCE], twist = q[TARGET], *c = contact->outputs;
    AtTwist at;
    if (compliance != 0.0) {
        if (contact->known)
            twist = contact->twist + (twist - contact->point[TARGET]) * (1.0 - compliance * c[STIFFNESS]);
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
    memcpy(contact->point, q, sizeof contact->point);
    memcpy(contact->coefficients, slice->coefficients, sizeof contact->coefficients);
    contact->twist = twist;
    contact->known = 1;
}
