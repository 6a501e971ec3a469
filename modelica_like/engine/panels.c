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
    if (!s->panel_valid || s->t + resolution >= panel->begin + (double)panel->parts * panel->width) {
        if (!c->integrator(far, panel)) return 0;
        s->panel_valid = 1;
    }
    double length = PARTS_OF_PIECE * panel->width, last = panel->begin + (double)panel->parts * panel->width;
    double number = floor((s->t - panel->begin) / length);
    if (panel->begin + (number + 1) * length <= s->t) number++; /* the quotient was rounded */
    double begin = panel->begin + number * length, end = fmin(panel->begin + (number + 1) * length, last);
    if (last - end < 0.5 * length) end = last;
    size_t row = (size_t)number * PARTS_OF_PIECE * (size_t)c->model->n_unknowns;
    piece_through(c->model, panel->knots + row, begin, end, c->piece);
    if (end < limit && limit - end <= resolution) c->piece->end = limit;
    if (s->t == begin && end <= limit) return 1;
    memcpy(c->whole, c->piece, piece_size(c->model));
    piece_between(c, c->whole, s->t, fmin(end, limit), c->piece);
    return 1;
}
