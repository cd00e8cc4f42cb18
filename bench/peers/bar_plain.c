// The bar as a loop in C, the same scheme as bar_taichi.py with nothing around it: no sorting of points, no ledger, no
// checks. It shows what a scheme costs without a solver. With several threads each has a grid of its own.
#include <stdlib.h>
#include <string.h>
#ifdef _OPENMP
#include <omp.h>
#endif

typedef struct {
    double x[2], v[2], c[4], f[4];
} Point;

static inline void weights(double f, double w[3]) {
    w[0] = 0.5 * (1.5 - f) * (1.5 - f), w[1] = 0.75 - (f - 1.0) * (f - 1.0), w[2] = 0.5 * (f - 0.5) * (f - 0.5);
}

// `grid` has four numbers a node: momentum, mass, and one that fills a cache line.
static inline void scatter(Point *restrict p, double *restrict grid, long rows, double h, double dt, double mass, double volume,
                           double shear) {
    const double inverse = 1.0 / h;
    const long bx = (long)(p->x[0] * inverse - 0.5), by = (long)(p->x[1] * inverse - 0.5);
    const double fx = p->x[0] * inverse - bx, fy = p->x[1] * inverse - by;
    double wx[3], wy[3];
    weights(fx, wx), weights(fy, wy);
    const double *c = p->c;
    double *f = p->f;
    const double xx = 1.0 + dt * c[0], xy = dt * c[1], yx = dt * c[2], yy = 1.0 + dt * c[3];
    const double fxx = xx * f[0] + xy * f[2], fxy = xx * f[1] + xy * f[3], fyx = yx * f[0] + yy * f[2], fyy = yx * f[1] + yy * f[3];
    f[0] = fxx, f[1] = fxy, f[2] = fyx, f[3] = fyy;
    const double z = -dt * volume * 4.0 * inverse * inverse * 2.0 * shear, sheared = z * 0.5 * (fxy + fyx);
    const double axx = z * (fxx - 1.0) + mass * c[0], axy = sheared + mass * c[1];
    const double ayx = sheared + mass * c[2], ayy = z * (fyy - 1.0) + mass * c[3];
    const double mx = mass * p->v[0] - h * (axx * fx + axy * fy), my = mass * p->v[1] - h * (ayx * fx + ayy * fy);
    for (int i = 0; i < 3; ++i) {
        double *restrict row = grid + 4 * ((bx + i) * rows + by);
        const double rx = mx + h * axx * i, ry = my + h * ayx * i;
        for (int j = 0; j < 3; ++j) {
            const double w = wx[i] * wy[j];
            row[4 * j] += w * (rx + h * axy * j);
            row[4 * j + 1] += w * (ry + h * ayy * j);
            row[4 * j + 2] += w * mass;
        }
    }
}

static inline void gather(Point *restrict p, const double *restrict grid, long rows, double h, double dt) {
    const double inverse = 1.0 / h, k = 4.0 * inverse;
    const long bx = (long)(p->x[0] * inverse - 0.5), by = (long)(p->x[1] * inverse - 0.5);
    const double fx = p->x[0] * inverse - bx, fy = p->x[1] * inverse - by;
    double wx[3], wy[3], v[2] = {0.0, 0.0}, c[4] = {0.0, 0.0, 0.0, 0.0};
    weights(fx, wx), weights(fy, wy);
    for (int i = 0; i < 3; ++i) {
        const double *restrict row = grid + 4 * ((bx + i) * rows + by);
        double s[2] = {0.0, 0.0}, t[2] = {0.0, 0.0};
        for (int j = 0; j < 3; ++j) {
            const double gx = wy[j] * row[4 * j], gy = wy[j] * row[4 * j + 1];
            s[0] += gx, s[1] += gy, t[0] += gx * (j - fy), t[1] += gy * (j - fy);
        }
        v[0] += wx[i] * s[0], v[1] += wx[i] * s[1];
        c[0] += wx[i] * (i - fx) * s[0], c[1] += wx[i] * t[0], c[2] += wx[i] * (i - fx) * s[1], c[3] += wx[i] * t[1];
    }
    for (int k2 = 0; k2 < 2; ++k2) p->v[k2] = v[k2], p->x[k2] += dt * v[k2];
    for (int k4 = 0; k4 < 4; ++k4) p->c[k4] = k * c[k4];
}

static void update(double *restrict grids, long nodes, long i, int threads) {
    double g[3] = {0.0, 0.0, 0.0};
    for (int t = 0; t < threads; ++t)
        for (int k = 0; k < 3; ++k) g[k] += grids[4 * (nodes * t + i) + k];
    const double one = g[2] > 0.0 ? 1.0 / g[2] : 0.0;
    grids[4 * i] = g[0] * one, grids[4 * i + 1] = g[1] * one;
}

void advance(Point *points, long count, long columns, long rows, double h, double dt, double mass, double volume, double shear,
             long steps, int threads) {
    const long nodes = columns * rows;
    double *grids = calloc(4 * nodes * threads, sizeof(double));
    for (long step = 0; step < steps; ++step) {
#pragma omp parallel num_threads(threads) if (threads > 1)
        {
            int me = 0;
#ifdef _OPENMP
            me = omp_get_thread_num();
#endif
            double *grid = grids + 4 * nodes * me;
            memset(grid, 0, 4 * nodes * sizeof(double));
#pragma omp for schedule(static)
            for (long i = 0; i < count; ++i) scatter(points + i, grid, rows, h, dt, mass, volume, shear);
#pragma omp for schedule(static)
            for (long i = 0; i < nodes; ++i) update(grids, nodes, i, threads);
#pragma omp for schedule(static)
            for (long i = 0; i < count; ++i) gather(points + i, grids, rows, h, dt);
        }
    }
    free(grids);
}
