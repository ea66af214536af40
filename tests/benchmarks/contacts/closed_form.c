/* The closed form of stiffness_model/equilibrium/closed_form.py as a plain loop, one element and one twist at a time,
 * for comparison with the speed of its NumPy form. Point contacts only; inputs (n,), results (m, n). */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

static double root(double x) /* x^(2/3) */
{
    double y = cbrt(x);
    return y * y;
}

void closed_form(ptrdiff_t n, ptrdiff_t m, int passes, int most_passes, double tolerance, double eccentricity,
                 const double *twist, const double *beta, const double *path_radius, const double *normal_r,
                 const double *normal_t, const double *gear_gap, const double *reach, const double *cage_gap,
                 const double *k_gear, const double *k_crank, const double *k_cage, double *gear, double *crank,
                 double *cage_plus, double *cage_minus, double *output_torque, double *crank_torque,
                 double *radial, double *tangential, signed char *status)
{
    double *fixed = malloc(4 * (size_t)n * sizeof *fixed); /* terms that do not depend on the twist */
    if (fixed == NULL)
        return;
    double *gear_compliance = fixed, *cage_compliance = fixed + n, *e_cos = fixed + 2 * n, *e_sin = fixed + 3 * n;
    for (ptrdiff_t j = 0; j < n; j++) {
        gear_compliance[j] = root(k_crank[j] / (k_gear[j] * normal_r[j])) / normal_r[j];
        cage_compliance[j] = root(k_crank[j] / k_cage[j]);
        e_cos[j] = eccentricity * cos(beta[j]);
        e_sin[j] = eccentricity * sin(beta[j]);
    }
    for (ptrdiff_t i = 0; i < m; i++) {
        double cos_i = cos(twist[i]), sin_i = sin(twist[i]);
        for (ptrdiff_t j = 0; j < n; j++) {
            double n_r = normal_r[j], slope = normal_t[j] / n_r;
            double centre_r = cos_i * e_cos[j] - sin_i * e_sin[j], centre_t = sin_i * e_cos[j] + cos_i * e_sin[j];
            double wall = -centre_t / (path_radius[j] - centre_r) >= slope ? 1.0 : -1.0, wall_slope = wall * slope;
            double free_displacement = gear_gap[j] / n_r - wall_slope * cage_gap[j];
            double d_r = path_radius[j] - centre_r + free_displacement, d_t = cage_gap[j] - wall * centre_t;
            double t = d_t / d_r, w = 0, per_u_r = 1, s = 0, x_r = 0, x_t = 0;
            for (int done = 1; done <= most_passes; done++) {
                w = t > wall_slope ? t - wall_slope : 0.0;
                double yield = cage_compliance[j] * root(w);
                per_u_r = sqrt(1.0 + t * t);
                s = (per_u_r * reach[j] - d_r - t * d_t) / (gear_compliance[j] + w * yield + per_u_r * root(per_u_r));
                if (s < 0.0)
                    s = 0.0;
                x_r = s * (gear_compliance[j] - wall_slope * yield);
                x_t = s * yield;
                double next = (d_t + x_t) / (d_r + x_r);
                if (done >= passes && fabs(next - t) <= tolerance)
                    break;
                t = next;
            }
            double force = k_crank[j] * s * sqrt(s), cage = wall * w * force;
            ptrdiff_t k = i * n + j;
            gear[k] = force / n_r;
            crank[k] = force * per_u_r;
            cage_plus[k] = cage > 0.0 ? cage : 0.0;
            cage_minus[k] = cage_plus[k] - cage;
            radial[k] = free_displacement + x_r;
            tangential[k] = wall * (cage_gap[j] + x_t);
            output_torque[k] = (path_radius[j] + radial[k]) * cage;
            crank_torque[k] = force * (wall * centre_r * t - centre_t);
            status[k] = s > 0.0;
        }
    }
    free(fixed);
}
