/* SPDX-License-Identifier: GPL-3.0-or-later
 * Published yields (yields.h). */
#include "yields.h"
#include <math.h>
#include <string.h>

const char *const element_symbols[N_ELEMENTS] = {"Z", "O", "Fe", "C", "N", "Ne", "Mg", "Si", "S", "Ca"};
const char *const element_names[N_ELEMENTS] = {
    "metals", "oxygen", "iron", "carbon", "nitrogen", "neon", "magnesium", "silicon", "sulfur", "calcium"};
const double element_solar[N_ELEMENTS] = {1, 0.428, 0.0963, 0.177, 0.0517, 0.0939, 0.0529, 0.0497, 0.0231, 0.00479};

/* The metals that are not told apart, manganese, nickel and others, are the rest of 1.4 Msun. */
const double yields_snia[N_ELEMENTS] = {1.4, 0.143, 0.743, 0.049, 1.2e-6, 0.0045, 0.0086, 0.156, 0.087, 0.012};

double yields_place(const struct yield_table *table, double metals, int *column)
{
    const double *z = table->metals;
    int k = 0;
    *column = 0;
    if (table->columns == 1 || metals <= z[0]) return 0;
    while (k < table->columns - 2 && metals > z[k + 1]) k++;
    *column = k;
    return fmin(1, log(metals / z[k]) / log(z[k + 1] / z[k]));
}

/* A net yield: what is more than at birth is made; what is less is part of what was there at birth, solar in proportion at the
 * metallicity of the table. */
static void add_net(struct yield *yield, enum element e, double net, double metals)
{
    yield->made[e] += fmax(net, 0);
    yield->burnt[e] += fmax(-net, 0) / (element_solar[e] * metals);
}

/* Between which of n ascending nodes m lies: *k and the next one; part of the way, below 0 or above 1 outside. */
static double find_place(const double *node, int n, double m, int *k)
{
    for (*k = 0; *k < n - 2 && m > node[*k + 1];) (*k)++;
    return (m - node[*k]) / (node[*k + 1] - node[*k]);
}

/* --- van den Hoek & Groenewegen 1997 --- */

/* Mass of the remnant [Msun]; net yields of C, N and O as fractions of the initial mass. */
struct wind { double remnant, c, n, o; };
enum { WIND_MASSES = 11 };
static const double wind_mass[WIND_MASSES] = {1, 1.3, 1.5, 1.7, 2, 2.5, 3, 4, 5, 7, 8};
static const struct wind wind_table[2][WIND_MASSES] = {
    {{0.57, 6.9e-4, 1.2e-4, 6.4e-5}, {0.64, 1.7e-3, 1.6e-4, 1.4e-4}, {0.57, 2.2e-3, 2.0e-4, 2.1e-4},
     {0.58, 3.5e-3, 2.2e-4, 3.1e-4}, {0.62, 4.9e-3, 3.4e-4, 3.6e-4}, {0.64, 5.9e-3, 4.2e-4, 4.0e-4},
     {0.66, 7.4e-3, 4.4e-4, 5.1e-4}, {0.91, 1.1e-3, 4.5e-3, 2.8e-4}, {0.98, 3.8e-4, 6.4e-3, 2.6e-4},
     {1.12, 5.1e-4, 8.6e-3, -2.5e-4}, {1.19, 4.6e-4, 9.4e-3, -3.2e-4}},
    {{0.47, -7.5e-5, 7.7e-4, 9.8e-4}, {0.58, -4.5e-4, 8.7e-4, 4.2e-4}, {0.53, 8.6e-4, 9.9e-4, 3.7e-4},
     {0.56, 1.3e-3, 1.0e-3, 1.8e-4}, {0.60, 2.4e-3, 1.3e-3, 7.8e-5}, {0.60, 4.1e-3, 1.5e-3, -4.2e-5},
     {0.62, 5.2e-3, 1.7e-3, -1.5e-6}, {0.79, 4.7e-3, 1.8e-3, -2.2e-4}, {0.92, -6.0e-4, 7.3e-3, -2.9e-4},
     {1.07, -6.2e-4, 9.8e-3, -1.3e-3}, {1.15, -7.5e-4, 1.1e-2, -1.6e-3}}};

/* Linear in mass; stars below 1 Msun leave what one of 1 Msun does, and no more than they are. */
static struct wind wind_of(const struct wind table[WIND_MASSES], double m)
{
    if (m <= wind_mass[0]) {
        struct wind first = table[0];
        first.remnant = fmin(first.remnant, m);
        return first;
    }
    int k;
    double x = find_place(wind_mass, WIND_MASSES, m, &k), y = 1 - x;
    const struct wind *a = &table[k], *b = a + 1;
    return (struct wind){y * a->remnant + x * b->remnant, y * a->c + x * b->c, y * a->n + x * b->n, y * a->o + x * b->o};
}

static void groenewegen_of(int column, double m, struct yield *yield)
{
    const struct wind wind = wind_of(wind_table[column], m);
    const double metals = yields_groenewegen1997.metals[column];
    const double net[3] = {m * wind.c, m * wind.n, m * wind.o};
    const enum element element[3] = {ELEMENT_C, ELEMENT_N, ELEMENT_O};
    memset(yield, 0, sizeof *yield);
    yield->mass = m - wind.remnant;
    yield->left = wind.remnant;
    for (int e = 0; e < 3; e++) {
        add_net(yield, element[e], net[e], metals);
        add_net(yield, ELEMENT_METALS, net[e], metals);
    }
}

const struct yield_table yields_groenewegen1997 = {2, {0.004, 0.02}, 0, 8, groenewegen_of};

/* --- Raiteri, Villata & Navarro 1996: fits to Woosley & Weaver 1995 --- */

double yields_snii_ejecta(double m) { return 0.7682 * pow(m, 1.056); }

/* Of oxygen and iron the fits tell all that is ejected, so that nothing of birth comes on top; other metals go with them. */
static void raiteri_of(int column, double m, struct yield *yield)
{
    const double o_to_metals = 2.09, fe_to_metals = 1.06;       /* Asplund et al. 2009 */
    (void)column;
    memset(yield, 0, sizeof *yield);
    yield->mass = yields_snii_ejecta(m);
    yield->left = m - yield->mass;
    yield->made[ELEMENT_FE] = 2.802e-4 * pow(m, 1.864);
    yield->made[ELEMENT_O] = 4.586e-4 * pow(m, 2.721);
    yield->made[ELEMENT_METALS] = o_to_metals * yield->made[ELEMENT_O] + fe_to_metals * yield->made[ELEMENT_FE];
    for (int e = ELEMENT_METALS; e <= ELEMENT_FE; e++) yield->burnt[e] = yield->mass;
}

const struct yield_table yields_raiteri1996 = {1, {0.02}, 8, 40, raiteri_of};

/* --- Portinari, Chiosi & Bressan 1998: winds and explosion --- */

/* Mass of the remnant, and net yields of the elements from oxygen on in the order of enum element [Msun]. */
struct massive { double remnant, net[N_ELEMENTS - ELEMENT_O]; };
enum { MASSIVE_MASSES = 9 };
static const double massive_mass[MASSIVE_MASSES] = {9, 12, 15, 20, 30, 40, 60, 100, 120};
static const struct massive massive_table[YIELD_COLUMNS][MASSIVE_MASSES] = {
    {   /* Z = 0.0004 */
        {1.35, {0.138585, 0.154764, 0.0891921, 0.000782665, 0.00913852, 0.00548816, 0.0306673, 0.0137086, 0.00258776}},
        {1.5, {0.669052, 0.156675, 0.169301, 0.00110237, 0.107597, 0.0289328, 0.0861179, 0.0437746, 0.00789321}},
        {1.8, {1.40759, 0.095492, 0.21312, 0.00130619, 0.0987104, 0.0265898, 0.199771, 0.117842, 0.0156789}},
        {2.07, {3.02662, 0.156446, 0.282798, 0.00194455, 0.0992038, 0.0756144, 0.339689, 0.171786, 0.0162713}},
        {6.98, {3.1458, -0.000272576, 0.348448, 0.00292349, 0.615259, 0.129633, 0.0117008, 1.50945e-5, -1.26208e-5}},
        {14.91, {0.819283, -0.000223563, 0.33731, 0.00435063, 0.270044, 0.0539004, -0.000127098, -0.000112626, -1.18318e-5}},
        {24.58, {0.281346, -0.000265876, 0.507624, 0.00685093, 0.000117357, -0.000230141, -0.000151235, -0.000141987, -1.42548e-5}},
        {32.06, {13.9372, -0.000890109, 0.714508, 0.00942025, 0.99736, 0.716918, 0.00555182, 0.00326866, 0.000509329}},
        {30.6, {19.1432, -0.00111346, 1.96398, 0.0139847, 1.32655, 0.865576, -0.000629329, -0.000509618, -5.85966e-5}}
    },
    {   /* Z = 0.004 */
        {1.35, {0.147617, 0.166635, 0.085243, 0.00705955, 0.0124832, 0.00543157, 0.0360734, 0.0180864, 0.00358764}},
        {1.5, {0.687717, 0.165754, 0.16404, 0.00952495, 0.116979, 0.0375276, 0.0903791, 0.0395461, 0.00669205}},
        {1.82, {1.28523, 0.120926, 0.231231, 0.0125922, 0.135921, 0.0565008, 0.191714, 0.095326, 0.0137892}},
        {2.04, {2.9162, 0.186448, 0.259032, 0.0151824, 0.0861299, 0.0448395, 0.370885, 0.197855, 0.0199127}},
        {6.98, {2.98689, -0.00265576, 0.303468, 0.0266805, 0.50112, 0.127334, 0.019208, -0.000369055, -9.12082e-5}},
        {12.6, {2.06866, -0.00285968, 0.342567, 0.0350388, 0.732484, 0.218636, -0.00162157, -0.00137212, -0.000151267}},
        {20.6333, {3.66608, -0.00412872, 0.33905, 0.0604088, 0.651886, 0.26873, -0.00234343, -0.00198118, -0.000218342}},
        {36.7, {6.86094, -0.00666681, 0.332015, 0.111149, 0.490692, 0.368918, -0.00378716, -0.00319931, -0.000352493}},
        {35.2, {-0.0127432, -0.00641272, 0.0698127, 0.206784, -0.00590213, -0.00550627, -0.00360558, -0.00341684, -0.000346388}}
    },
    {   /* Z = 0.008 */
        {1.35, {0.191805, 0.134271, 0.248894, 0.0116122, 0.00516831, 0.00124314, 0.0385468, 0.0262729, 0.00543527}},
        {1.48, {0.656486, 0.151496, 0.154076, 0.0189951, 0.110931, 0.0308489, 0.0911514, 0.0424874, 0.00721346}},
        {1.84, {1.26039, 0.111864, 0.230528, 0.023928, 0.132866, 0.047608, 0.199436, 0.0960569, 0.012879}},
        {2.04, {2.7825, 0.182897, 0.247116, 0.0295378, 0.0930737, 0.0384789, 0.365771, 0.19071, 0.0195255}},
        {6.9, {2.97331, -0.00532099, 0.28179, 0.048578, 0.484179, 0.125642, 0.0212882, -0.00137722, -0.000235976}},
        {12.5, {2.10676, -0.00560117, 0.314872, 0.0657542, 0.634905, -0.00201996, -0.00318782, -0.00252812, -0.000254733}},
        {5.69, {4.57794, -0.0101758, 7.25668, 0.111026, 0.481, 0.1667, 0.0346637, -0.00324143, -0.000497393}},
        {8.49, {7.3628, -0.0155071, 15.6203, 0.23989, 0.724046, 0.08665, 0.00836162, -0.0069463, -0.000780765}},
        {9.89, {8.75522, -0.0181727, 19.8021, 0.304323, 0.84557, 0.0466251, -0.00478941, -0.00879874, -0.000922451}}
    },
    {   /* Z = 0.02 */
        {1.31, {0.105591, 0.0449146, 0.0473211, 0.0324331, 0.00486182, 0.000515992, 0.0695322, 0.0576083, 0.011185}},
        {1.44, {0.612535, 0.104679, 0.135028, 0.0439798, 0.102759, 0.0193904, 0.101844, 0.0547946, 0.00955546}},
        {1.87, {1.14929, 0.0776068, 0.222415, 0.0535578, 0.149725, 0.0257438, 0.201615, 0.0867601, 0.00924992}},
        {2.11, {2.59234, 0.15835, 0.219017, 0.0703832, 0.179346, 0.0548531, 0.319488, 0.145318, 0.0153692}},
        {7.18, {2.86624, -0.0130697, 0.22987, 0.104902, 0.456, 0.105827, 0.0209134, -0.00460586, -0.000655046}},
        {2.06, {1.70218, 0.0743614, 2.90203, 0.172576, 0.337379, 0.0083861, 0.265103, 0.131346, 0.0122657}},
        {2.09, {2.1174, 0.144497, 4.73458, 0.284326, 0.35247, 0.00988279, 0.309788, 0.146422, 0.0140686}},
        {2.12, {3.3518, 0.0997205, 11.0703, 0.582779, 0.86259, 0.0520523, 0.286131, 0.117556, 0.013472}},
        {2.11, {2.40992, 0.124794, 8.23276, 0.890512, 0.643597, 0.0191171, 0.299781, 0.126608, 0.0133717}}
    },
    {   /* Z = 0.05 */
        {1.31, {0.106157, 0.0363866, 0.0475176, 0.0684387, -0.00170545, -0.00371002, 0.0759305, 0.0640207, 0.0126625}},
        {1.49, {0.655178, 0.0883904, 0.137688, 0.0894405, 0.117589, 0.0173756, 0.101218, 0.0494112, 0.00839864}},
        {1.98, {1.27478, 0.080692, 0.220907, 0.103049, 0.0603208, 0.00457848, 0.256777, 0.115564, 0.0116968}},
        {2.38, {3.03015, 0.083918, 0.228024, 0.129466, 0.326307, 0.0889203, 0.260805, 0.105698, 0.0121771}},
        {1.965, {1.73212, 0.0691755, 1.12118, 0.258008, 0.53579, 0.0439851, 0.175229, 0.0697006, 0.0092447}},
        {1.55, {0.434094, 0.0544329, 2.01433, 0.38655, 0.745273, -0.000950105, 0.0896525, 0.0337036, 0.00631233}},
        {1.7, {0.388241, 0.0127344, 3.16594, 0.912092, 0.70413, -0.00506947, 0.0906239, 0.0189725, 0.00334354}},
        {1.68, {-0.0930988, -0.022899, 2.95696, 1.54047, 1.34817, -0.0387453, 0.0678732, -0.000767552, 0.00154197}},
        {1.68, {0.047451, -0.041177, 2.82026, 1.8097, 1.31824, -0.0555633, 0.0575195, -0.0106226, 0.000543181}}
    }
};

/* Linear in mass; below the first mass as much of what is ejected as there. */
static void portinari_of(int column, double m, struct yield *yield)
{
    const double metals = yields_portinari1998.metals[column];
    const struct massive *table = massive_table[column];
    int k;
    double x = fmax(find_place(massive_mass, MASSIVE_MASSES, m, &k), 0);
    const struct massive *a = &table[k], *b = a + 1;
    memset(yield, 0, sizeof *yield);
    yield->left = (1 - x) * a->remnant + x * b->remnant;
    yield->mass = m - yield->left;
    const double part = fmin(1, yield->mass / (massive_mass[0] - table[0].remnant));
    for (int e = ELEMENT_O; e < N_ELEMENTS; e++) {
        double net = part * ((1 - x) * a->net[e - ELEMENT_O] + x * b->net[e - ELEMENT_O]);
        add_net(yield, (enum element)e, net, metals);
        add_net(yield, ELEMENT_METALS, net, metals);
    }
}

const struct yield_table yields_portinari1998 = {YIELD_COLUMNS, {0.0004, 0.004, 0.008, 0.02, 0.05}, 8, 100, portinari_of};
