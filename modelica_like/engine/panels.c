/* Pieces, and those of another integrator: it goes ahead in panels, whose knots four parts of equal width take
 * together. */
#include "core.h"

#define PARTS_OF_PIECE 4
#define LOOKS (2 * PARTS_OF_PIECE) /* results of a piece: those between knots tell how far its polynomial is off */
#define MOST_PANELS 20             /* tried: what switches without end is integrated as it is written */
#define PRECISE 1 /* largest error of a polynomial in tolerances; the one to aim at: IDAS has about one itself */
#define AIM 0.3
#define HALVED \
    8           /* largest error of a piece that becomes precise in halves: smooth ones are 32 times as precise there */
#define ORDER 5 /* of that error, in the length of a piece */
#define SHRINKS_AT_MOST 0.1 /* what an error tells about the length of pieces */
#define GROWS_AT_MOST 30

double *last_of(const Model *m, Piece *piece) { return piece->points + m->n_unknowns; }

size_t piece_size(const Model *m) { return sizeof(Piece) + 5 * (size_t)m->n_unknowns * sizeof(double); }

/* Dense output. */
void piece_at(const Model *m, const Piece *piece, double t, double *point) {
    double s = (t - piece->begin) / (piece->end - piece->begin), r = 1 - s;
    int n = m->n_unknowns;
    const double *first = piece->points, *last = first + n, *a = last + n, *b = a + n, *c = b + n;
    if (t >= piece->end) {
        memcpy(point, last, (size_t)n * sizeof(double));
        return;
    }
    for (int k = 0; k < n; k++) point[k] = first[k] + s * (last[k] - first[k] + r * (a[k] + s * (b[k] + s * c[k])));
}

/* The polynomials of degree four through five rows at equal distances, as `piece_at` wants them. */
static void piece_through(const Model *m, const double *rows, double begin, double end, Piece *piece) {
    int n = m->n_unknowns;
    double *first = piece->points, *last = first + n, *a = last + n, *b = a + n, *c = b + n;
    piece->begin = begin;
    piece->end = end;
    for (int k = 0; k < n; k++) {
        double y0 = rows[k], y1 = rows[n + k], y2 = rows[2 * n + k], y3 = rows[3 * n + k], y4 = rows[4 * n + k];
        double second = y2 - 2 * y1 + y0, third = y3 - 3 * (y2 - y1) - y0;
        double fourth = y4 - 4 * (y3 + y1) + 6 * y2 + y0;
        double square = 8 * (second - third) + 22.0 / 3 * fourth, cube = 32.0 / 3 * third - 16 * fourth;
        double biquadrate = 32.0 / 3 * fourth;
        first[k] = y0;
        last[k] = y4;
        a[k] = -(square + cube + biquadrate);
        b[k] = -(cube + biquadrate);
        c[k] = -biquadrate;
    }
}

/* A part of a piece. */
void piece_between(Instance *c, const Piece *whole, double begin, double end, Piece *piece) {
    const Model *m = c->model;
    double *rows = c->stages;
    for (int k = 0; k <= PARTS_OF_PIECE; k++)
        piece_at(m, whole, k < PARTS_OF_PIECE ? begin + (end - begin) * k / PARTS_OF_PIECE : end,
            rows + (size_t)k * (size_t)m->n_unknowns);
    piece_through(m, rows, begin, end, piece);
}

/* Errors of polynomials in the middles between their knots, in tolerances and the norm of IDAS, from the rows of all
 * looks. */
static double error_of_looks(const Model *m, const double *rows, double relative, double absolute) {
    static const double weights[PARTS_OF_PIECE][PARTS_OF_PIECE + 1] = {
        {35, 140, -70, 28, -5}, {-5, 60, 90, -20, 3}, {3, -20, 90, 60, -5}, {-5, 28, -70, 140, 35}};
    size_t n = (size_t)m->n_unknowns;
    double sum = 0;
    for (int k = 0; k < m->n_x; k++) {
        const double *y = rows + k;
        double size = 0.5 * relative * (fabs(y[0]) + fabs(y[LOOKS * n])) + absolute * m->nominals[k], most = 0;
        for (size_t part = 0; part < PARTS_OF_PIECE; part++) {
            double between = 0;
            for (size_t j = 0; j <= PARTS_OF_PIECE; j++) between += weights[part][j] / 128 * y[2 * j * n];
            double error = fabs(between - y[(2 * part + 1) * n]);
            most = isnan(error) ? INFINITY : max_of(most, error);
        }
        sum += (most / size) * (most / size);
    }
    return isnan(sum) ? INFINITY : sqrt(sum / m->n_x);
}

/* Pieces that are not precise become two, with all looks as knots; the first one that is still rough ends the panel. */
void take_looks(Instance *c, Looks *looks) {
    const Model *m = c->model;
    size_t n = (size_t)m->n_unknowns, n_x = (size_t)m->n_x, n_z = n - n_x, row = n * sizeof(double);
    double *rows = memcpy(c->stages, c->x, row), *knot = memcpy(looks->knots, rows, row), begin = 0;
    double resolution = TIME_RESOLUTION * max_of(1, fabs(c->state.t));
    c->panel = (Panel){c->state.t, c->panel.longest, c->panel.soon, 0, 0, looks->ends, looks->knots};
    for (looks->precise = 0; (looks->precise + 1) * LOOKS <= looks->results; looks->precise++) {
        size_t first = (size_t)looks->precise * LOOKS;
        for (size_t k = 0; k < LOOKS; k++) {
            memcpy(rows + (k + 1) * n, looks->x + (first + k) * n_x, n_x * sizeof(double));
            memcpy(rows + (k + 1) * n + n_x, looks->z + (first + k) * n_z, n_z * sizeof(double));
        }
        double end = looks->shares[first + LOOKS - 1], length = looks->span * (end - begin);
        double error = error_of_looks(m, rows, looks->relative, looks->absolute);
        double change = min_of(max_of(pow(AIM / error, 1.0 / ORDER), SHRINKS_AT_MOST), GROWS_AT_MOST);
        int halves = error > PRECISE ? 2 : 1, rough = error > HALVED && length > resolution; /* shorter: a jump */
        for (int half = 1; half <= halves; half++) {
            int64_t piece = c->panel.pieces;
            looks->wishes[piece] = length * change;
            looks->errors[piece] = error;
            if (rough) return;
            looks->ends[piece] = c->state.t + looks->span * (half < halves ? 0.5 * (begin + end) : end);
            c->panel.pieces++;
        }
        for (int k = 3 - halves; k <= LOOKS; k += 3 - halves) memcpy(knot += n, rows + (size_t)k * n, row);
        memcpy(rows, rows + LOOKS * n, row);
        begin = end;
    }
}

static double begin_of(const Panel *panel) { return panel->number > 0 ? panel->ends[panel->number - 1] : panel->begin; }

static void load_piece(Instance *c) {
    const Panel *panel = &c->panel;
    const double *rows = panel->knots + panel->number * PARTS_OF_PIECE * c->model->n_unknowns;
    piece_through(c->model, rows, begin_of(panel), panel->ends[panel->number], c->piece);
}

/* Behind an event that moves something, equations of the old modes are not valid. */
static int is_behind_event(Instance *c) {
    const double *guards = c->looks;
    if (c->model->n_guards == 0) return 0;
    evaluate_special(c, &c->model->tapes.guards, c->piece->end, last_of(c->model, c->piece), c->looks);
    for (int g = 0; g < c->model->n_guards; g++)
        if (guards[g] > 0 && guard_active(c, g) && c->felt[c->model->transitions[c->model->guard_transition[g]].mode])
            return 1;
    return 0;
}

/* Judges the pieces of a new panel. Returns the time at which it has to end, as it has not seen what comes behind, or
 * infinity; where waves ask for shorter pieces, `longest` is smaller than before. */
static double judge_panel(Instance *c) {
    Panel *panel = &c->panel;
    double least = least_step(&c->state), most, end = INFINITY;
    c->edges_valid = 0;
    for (panel->number = 0; panel->number < panel->pieces && isinf(end); panel->number++) {
        load_piece(c);
        double seen = seen_length(c, least, &most), h = c->piece->end - c->piece->begin;
        keep_edges(c);
        if (seen < h && seen == most) panel->longest = end = seen;
        else if (seen < h) end = c->piece->begin + seen;
        else if (is_behind_event(c)) break;
    }
    c->edges_valid = c->look_valid = 0;
    return end;
}

/* A panel that steps over no edge: where it does, it is cut there. */
static int new_panel(Instance *c, double far) {
    Panel *panel = &c->panel;
    panel->longest = INFINITY;
    panel->soon = soonest_zero(c);
    for (int n = 0; n < MOST_PANELS; n++) {
        double longest = panel->longest;
        if (!c->integrator(far, panel)) return 0;
        double end = c->model->tapes.edges.n_outputs > 0 ? judge_panel(c) : INFINITY;
        if (isinf(end)) break;
        if (panel->longest == longest) far = min_of(far, end);
    }
    panel->number = 0;
    return c->state.panel_valid = 1;
}

/* The next piece from the present point, up to `limit` at most; panels go as far as `far`, behind time events that
 * change nothing that moves. Returns 0 where the integrator cannot go on. */
int next_piece(Instance *c, double limit, double far) {
    State *s = &c->state;
    Panel *panel = &c->panel;
    double resolution = just_after(s) - s->t;
    int ended = !s->panel_valid || s->t + resolution >= panel->ends[panel->pieces - 1];
    if (ended && !new_panel(c, far)) return 0;
    while (panel->ends[panel->number] <= s->t) panel->number++;
    load_piece(c);
    if (s->t == c->piece->begin && c->piece->end <= limit) return 1;
    memcpy(c->whole, c->piece, piece_size(c->model));
    piece_between(c, c->whole, s->t, min_of(c->piece->end, limit), c->piece);
    return 1;
}
