/* Pieces of another integrator: it goes ahead in panels, whose knots four parts of equal width take together. */
#include "core.h"

#define PARTS_OF_PIECE 4

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

/* The next piece from the present point, up to `limit` at most; panels go as far as `far`, behind time events that
 * change nothing that moves. Returns 0 where the integrator cannot go on. */
int next_piece(Instance *c, double limit, double far) {
    State *s = &c->state;
    Panel *panel = &c->panel;
    double resolution = just_after(s) - s->t;
    if (!s->panel_valid || s->t + resolution >= panel->ends[panel->pieces - 1]) {
        if (!c->integrator(far, panel)) return 0;
        panel->number = 0;
        s->panel_valid = 1;
    }
    while (panel->ends[panel->number] <= s->t) panel->number++;
    double begin = panel->number > 0 ? panel->ends[panel->number - 1] : panel->begin;
    const double *rows = panel->knots + panel->number * PARTS_OF_PIECE * c->model->n_unknowns;
    piece_through(c->model, rows, begin, panel->ends[panel->number], c->piece);
    if (s->t == begin && c->piece->end <= limit) return 1;
    memcpy(c->whole, c->piece, piece_size(c->model));
    piece_between(c, c->whole, s->t, fmin(c->piece->end, limit), c->piece);
    return 1;
}
