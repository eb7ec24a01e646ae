/* IDA on the spherical pendulum at index 2, as a user of SUNDIALS would write it: M v' = -U_q - G^T lam, G v = 0, with Lam' = lam as unknown.
   Nothing of SUNDIALS is included or linked: its functions come as a table of addresses, in the order of IDA_C in solver_timing.py. */

typedef double *(*Data)(void *);

static Data vector_data, matrix_data;

static int residual(double t, void *y_, void *yp_, void *res_, void *user) {
    const double *y = vector_data(y_), *yp = vector_data(yp_), *par = user;
    const double m = par[0], gravity = par[2], twice = 2.0 * yp[6];
    double *res = vector_data(res_);
    for (int i = 0; i < 3; i++) res[i] = yp[i] - y[3 + i];
    res[3] = m * yp[3] + twice * y[0];
    res[4] = m * yp[4] + twice * y[1];
    res[5] = m * gravity + m * yp[5] + twice * y[2];
    res[6] = 2.0 * y[0] * y[3] + 2.0 * y[1] * y[4] + 2.0 * y[2] * y[5];
    return 0;
}

static int jacobian(double t, double cj, void *y_, void *yp_, void *res_, void *J_, void *user, void *a, void *b, void *c) {
    const double *y = vector_data(y_), *yp = vector_data(yp_), *par = user;
    double *J = matrix_data(J_);
    for (int i = 0; i < 49; i++) J[i] = 0.0;
    for (int i = 0; i < 3; i++) {
        J[7 * i + i] = cj;
        J[7 * (3 + i) + i] = -1.0;
        J[7 * i + 3 + i] = 2.0 * yp[6];
        J[7 * (3 + i) + 3 + i] = par[0] * cj;
        J[7 * 6 + 3 + i] = cj * (2.0 * y[i]);
        J[7 * i + 6] = 2.0 * y[3 + i];
        J[7 * (3 + i) + 6] = 2.0 * y[i];
    }
    return 0;
}

/* Fill rows at the given times; return the number of steps, or the flag with which SUNDIALS stopped. */
long ida(void **f, double *par, double *y, double *yp, double *atol, double tol, const double *times, long n, double *rows) {
    void *context = 0, *mem;
    double t = 0.0, scratch[7];
    long steps = 0, k = 0;
    int flag = 0;
    ((int (*)(int, void **))f[0])(0, &context);
    vector_data = (Data)f[1];
    matrix_data = (Data)f[2];
    void *(*make)(long, double *, void *) = (void *(*)(long, double *, void *))f[3];
    void *vy = make(7, y, context), *vyp = make(7, yp, context), *va = make(7, atol, context), *vs = make(7, scratch, context);
    mem = ((void *(*)(void *))f[4])(context);
    ((int (*)(void *, void *, double, void *, void *))f[5])(mem, (void *)residual, 0.0, vy, vyp);
    ((int (*)(void *, double, void *))f[6])(mem, tol, va);
    ((int (*)(void *, void *))f[7])(mem, par);
    void *J = ((void *(*)(long, long, void *))f[8])(7, 7, context);
    void *linear = ((void *(*)(void *, void *, void *))f[9])(vy, J, context);
    ((int (*)(void *, void *, void *))f[10])(mem, linear, J);
    ((int (*)(void *, void *))f[11])(mem, (void *)jacobian);
    ((int (*)(void *, double))f[12])(mem, times[n - 1]);
    int (*solve)(void *, double, double *, void *, void *, int) = (int (*)(void *, double, double *, void *, void *, int))f[13];
    int (*between)(void *, double, int, void *) = (int (*)(void *, double, int, void *))f[14];
    while (k < n && flag >= 0) {
        flag = solve(mem, times[n - 1], &t, vy, vyp, 2);
        steps++;
        for (; k < n && times[k] <= t; k++) {
            between(mem, times[k], 0, vs);
            for (int i = 0; i < 7; i++) rows[7 * k + i] = scratch[i];
        }
    }
    ((void (*)(void **))f[15])(&mem);
    ((int (*)(void *))f[16])(linear);
    ((void (*)(void *))f[17])(J);
    void *vectors[4] = {vs, va, vyp, vy};
    for (int i = 0; i < 4; i++) ((void (*)(void *))f[18])(vectors[i]);
    ((int (*)(void **))f[19])(&context);
    return flag < 0 ? flag : steps;
}
