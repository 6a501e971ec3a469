/* The method of integrate.c and, transposed, of adjoint.c. */
#ifndef RODAS_H
#define RODAS_H

#include "core.h"

/* One step of RODAS5P: a stiffly accurate, L-stable Rosenbrock method of order 5(4) for index-1 systems with dense
 * output of order 4 (G. Steinebach, BIT Numerical Mathematics 63:27, 2023). Notation as in Hairer & Wanner II, ch.
 * IV.7, with the transformation that avoids products with the Jacobian, M = diag(1 for x, 0 for z): (M/(h gamma) - J)
 * k_i = f(t + c_i h, y + sum a_ij k_j) + sum (C_ij/h) M k_j + h d_i df/dt. */
#define STAGES 8
#define LAST_POINTS 6 /* from here on a stage's point is the point of the stage before, moved by that stage */
#define RODAS_GAMMA 0.21193756319429014

static const double RODAS_A[LAST_POINTS][LAST_POINTS - 1] = {
    {0},
    {3.0},
    {2.849394379747939, 0.45842242204463923},
    {-6.954028509809101, 2.489845061869568, -10.358996098473584},
    {2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641},
    {-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946},
};
static const double RODAS_C[STAGES][STAGES - 1] = {
    {0},
    {-14.155112264123755},
    {-17.97296035885952, -2.859693295451294},
    {147.12150275711716, -1.41221402718213, 71.68940251302358},
    {165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306},
    {24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471},
    {30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783, -19.097331116725623,
        -28.087943162872662},
    {37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047, -40.06618937091002,
        -54.66780262877968, -9.48861652309627},
};
static const double RODAS_TIME[STAGES] = {
    0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1, 1, 1};
static const double RODAS_D_TIME[STAGES] = {
    0.21193756319429014, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734, 2.325825639765069, 0, 0, 0};

#endif
