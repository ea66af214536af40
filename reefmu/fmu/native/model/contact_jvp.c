/* Directional derivative (Jacobian-vector product) of the outputs of the contacts, by the implicit function theorem
   where there is a compliance in series. */

/* A quantity at a twist of the contacts, with its first and second derivatives by twist (t), clearance (c) and position
   (p). */
typedef struct { double value, by_t, by_c, by_p, by_tt, by_tc, by_tp; } Slopes;

/* Weighted sum over the 4 x 4 coefficients of a cell. */
static double over_cell(const double *from, int stride, const double *rows, const double *columns) {
    double sum = 0.0;
    for (int a = 0; a < 4; a++) sum += rows[a] * dot(columns, from + a * stride);
    return sum;
}

/* Weights of a cell and their derivatives: up to the second along the twist, up to the first along the clearance. */
typedef struct { double twist[3][4], clearance[2][4]; } Weights;

static void set_weights(Weights *weights, double f, double g, double twist_step, double clearance_step) {
    cubic_extrapolated(f, weights->twist[0], weights->twist[1]);
    cubic_curvatures(clamped(f), weights->twist[2]);
    cubic(clamped(g), weights->clearance[0]);
    cubic_slopes(clamped(g), weights->clearance[1]);
    for (int k = 0; k < 4; k++) {
        weights->twist[1][k] /= twist_step;
        weights->twist[2][k] *= f == clamped(f) ? 1.0 / (twist_step * twist_step) : 0.0;
        weights->clearance[1][k] *= g == clamped(g) ? 1.0 / clearance_step : 0.0;
    }
}

#if !HAS_CONTACT_FUNCTION
static Slopes lookup_slopes(const Slice *slice, const Weights *w, int quantity) {
    const double *from =
        slice->tables->lookup + (quantity * LOOKUP_ROWS + slice->cell) * LOOKUP_COLUMNS + slice->column;
    Slopes slopes = {0};
    slopes.value = over_cell(from, LOOKUP_COLUMNS, w->twist[0], w->clearance[0]);
    slopes.by_t = over_cell(from, LOOKUP_COLUMNS, w->twist[1], w->clearance[0]);
    slopes.by_c = over_cell(from, LOOKUP_COLUMNS, w->twist[0], w->clearance[1]);
    slopes.by_tt = over_cell(from, LOOKUP_COLUMNS, w->twist[2], w->clearance[0]);
    slopes.by_tc = over_cell(from, LOOKUP_COLUMNS, w->twist[1], w->clearance[1]);
    return slopes;
}
#endif

static void add(Slopes *to, Slopes slopes, double factor) {
    to->value += factor * slopes.value;
    to->by_t += factor * slopes.by_t, to->by_c += factor * slopes.by_c, to->by_p += factor * slopes.by_p;
    to->by_tt += factor * slopes.by_tt, to->by_tc += factor * slopes.by_tc, to->by_tp += factor * slopes.by_tp;
}

#if HAS_ELEMENT
static Slopes element_slopes(const Slice *slice, const double *q, double twist) {
    double f, g, h, sign, fraction, fraction_slope, position[2][4], value, by_t;
    double beta = element_angle(q[POSITION], &sign, &fraction);
    int row = find_cell(ELEMENT_TWIST_AXIS, sign * twist, &f);
    int column = find_cell(ELEMENT_CLEARANCE_AXIS, q[CLEARANCE], &g);
    int layer = find_cell(ELEMENT_POSITION_AXIS, beta, &h);
    const double *from = slice->tables->element + (row * ELEMENT_COLUMNS + column) * ELEMENT_LAYERS + layer;
    Weights w;
    double sum[3][2][2] = {{{0}}}; /* by order of the derivative along twist, clearance, position */
    Slopes slopes = {0};
    set_weights(&w, f, g, ELEMENT_TWIST_STEP, ELEMENT_CLEARANCE_STEP);
    cubic(h, position[0]);
    cubic_slopes(h, position[1]);
    for (int a = 0; a < 4; a++)
        for (int t = 0; t < 3; t++)
            for (int c = 0; c < 2; c++)
                for (int p = 0; p < 2; p++)
                    sum[t][c][p] += w.twist[t][a] * over_cell(from + a * ELEMENT_COLUMNS * ELEMENT_LAYERS,
                                                              ELEMENT_LAYERS, w.clearance[c], position[p]);
    fraction_slope = fraction > 0.0 && fraction < 1.0 ? -1.0 / (2.0 * ELEMENT_EDGE) : 0.0;
    value = sum[0][0][0], by_t = sum[1][0][0];
    slopes.value = sign * fraction * value;
    slopes.by_t = fraction * by_t;
    slopes.by_c = sign * fraction * sum[0][1][0];
    slopes.by_p = fraction * sum[0][0][1] / ELEMENT_POSITION_STEP + fraction_slope * value;
    slopes.by_tt = sign * fraction * sum[2][0][0];
    slopes.by_tc = fraction * sum[1][1][0];
    slopes.by_tp = sign * (fraction * sum[1][0][1] / ELEMENT_POSITION_STEP + fraction_slope * by_t);
    return slopes;
}
#endif

/* change: of contact->outputs, for the changes dq of the contact point and dr of the coefficients. */
static void contact_jvp(const Slice *at, const Contact *contact, const double *dq, const double *dr, double *change) {
    Slice slice = *at;
    AtTwist at_twist;
    const double *coefficients = at->coefficients;
    Slopes torque = {0}, by_coefficients = {0}; /* the latter: derivative along dr at this twist */
    double value, slope, series_factor, twist_change;
    double scale = coefficients[SCALE], compliance = coefficients[COMPLIANCE];
    double relative_scale_change = dr[SCALE] / scale;
#if HAS_CONTACT_FUNCTION
    /* Change of the outputs with clearance and angle at a fixed twist, and per radian of twist. */
    double at_fixed_twist[N_CONTACT], per_twist[N_CONTACT];
    double along_point[3] = {0.0, dq[CLEARANCE], 0.0}, along_twist[3] = {1.0, 0.0, 0.0};
#if HAS_ANGLE
    along_point[2] = dq[ANGLE];
#endif
    at_twist = contacts_at_twist(&slice, contact->twist);
    evaluate_contact_function(contact_function_jvp, &slice, contact->twist, along_point, at_fixed_twist);
    evaluate_contact_function(contact_function_jvp, &slice, contact->twist, along_twist, per_twist);
    torque.by_t = per_twist[TORQUE], torque.by_tt = per_twist[STIFFNESS];
#else
    Weights w;
    Slopes blend = {0}, force, share;
    double sign, band;
    at_twist = contacts_at_twist(&slice, contact->twist);
    sign = slice.sign, band = sign * coefficients[BAND];
    set_weights(&w, at_twist.f, slice.clearance_offset, LOOKUP_TWIST_STEP, LOOKUP_CLEARANCE_STEP);
    add(&blend, lookup_slopes(&slice, &w, TABLE_TORQUE_MEAN), 1.0 - fabs(band));
    if (band != 0.0)
        add(&blend, lookup_slopes(&slice, &w, band > 0.0 ? TABLE_TORQUE_P90 : TABLE_TORQUE_P10), fabs(band));
    if (dr[BAND] != 0.0) { /* at the mean, the average of the slopes on either side, as in the model */
        double up = band > 0.0 ? 1.0 : band < 0.0 ? 0.0 : 0.5;
        Slopes mean = lookup_slopes(&slice, &w, TABLE_TORQUE_MEAN);
        add(&by_coefficients, lookup_slopes(&slice, &w, TABLE_TORQUE_P90), up * dr[BAND]);
        add(&by_coefficients, mean, (1.0 - 2.0 * up) * dr[BAND]);
        add(&by_coefficients, lookup_slopes(&slice, &w, TABLE_TORQUE_P10), (up - 1.0) * dr[BAND]);
        by_coefficients.by_t *= sign; /* the torque is odd in the twist, and so is the effect of the band */
    }
    /* The torque is odd in the twist. */
    torque.by_t = blend.by_t, torque.by_c = sign * blend.by_c, torque.by_tt = sign * blend.by_tt;
    torque.by_tc = blend.by_tc;
#endif
#if HAS_ELEMENT
    if (coefficients[MISSING] != 0.0)
        add(&torque, element_slopes(&slice, contact->point, contact->twist), -coefficients[MISSING]);
    if (dr[MISSING] != 0.0)
        add(&by_coefficients, element_slopes(&slice, contact->point, contact->twist), -dr[MISSING]);
#endif
    series_factor = 1.0 / (1.0 + compliance * at_twist.stiffness);
    /* Change of torque and stiffness at a fixed twist of the contacts. */
    value = scale * (torque.by_c * dq[CLEARANCE] + torque.by_p * dq[POSITION] + by_coefficients.value) +
            relative_scale_change * at_twist.torque;
    slope = scale * (torque.by_tc * dq[CLEARANCE] + torque.by_tp * dq[POSITION] + by_coefficients.by_t) +
            relative_scale_change * at_twist.stiffness;
#if HAS_CONTACT_FUNCTION
    value += scale * at_fixed_twist[TORQUE];
    slope += scale * at_fixed_twist[STIFFNESS];
#endif
    twist_change = (dq[TARGET] - compliance * value - dr[COMPLIANCE] * at_twist.torque) * series_factor;
    change[TORQUE] = scale * torque.by_t * twist_change + value;
    change[STIFFNESS] = series_factor * series_factor * (scale * torque.by_tt * twist_change + slope -
                                           at_twist.stiffness * at_twist.stiffness * dr[COMPLIANCE]);
#if HAS_CONTACT_FUNCTION
    change[MAX_CONTACT_FORCE] =
        scale * (per_twist[MAX_CONTACT_FORCE] * twist_change + at_fixed_twist[MAX_CONTACT_FORCE]);
    change[LOAD_SHARE] = per_twist[LOAD_SHARE] * twist_change + at_fixed_twist[LOAD_SHARE];
#else
    force = lookup_slopes(&slice, &w, TABLE_MAX_CONTACT_FORCE), share = lookup_slopes(&slice, &w, TABLE_LOAD_SHARE);
    change[MAX_CONTACT_FORCE] = scale * (sign * force.by_t * twist_change + force.by_c * dq[CLEARANCE]);
    change[LOAD_SHARE] = sign * share.by_t * twist_change + share.by_c * dq[CLEARANCE];
#endif
    change[MAX_CONTACT_FORCE] += relative_scale_change * contact->outputs[MAX_CONTACT_FORCE];
    change[IN_RANGE] = 0.0;
}
