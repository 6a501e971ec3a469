/* Pieces, and those of another integrator: it goes ahead in panels, whose knots four parts of equal width take
 * together. */
#include "core.h"

#define PARTS_OF_PIECE 4
#define MOST_PANELS 20 /* tried: what switches without end is integrated as it is written */

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
    for (int n = 0; n < MOST_PANELS; n++) {
        double longest = panel->longest;
        if (!c->integrator(far, panel)) return 0;
        double end = c->model->tapes.edges.n_outputs > 0 ? judge_panel(c) : INFINITY;
        if (isinf(end)) break;
        if (panel->longest == longest) far = fmin(far, end);
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
    piece_between(c, c->whole, s->t, fmin(c->piece->end, limit), c->piece);
    return 1;
}
