/* Edges, at which slopes change or jump without an event: an accepted step has to see what lies between them. */
#include "core.h"

#define PARTS 8       /* of a step in which edges are located */
#define LOCATED 1e-13 /* of the step */
#define BEHIND 1e-12  /* of a step that ends at an edge: the next one begins behind it */
#define ROUNDS 60
#define SECANTS 20 /* of these, on straight lines at times: flat edges are halved */
#define REACH 2
#define ROUGHLY 1e-8    /* of a part: edges that stand alone and are smooth need no better */
#define NEAR 0.1        /* an extremum that comes this close to zero is looked at */
#define UNSEEN 10       /* error of a window between two edges, in tolerances, from which on the step ends before it */
#define UNEXPLAINED 300 /* of a piece of another integrator: less is the error of its steps, which are longer */
#define CURVED 4        /* parts of a window whose slopes may be curved: their error is 256 times as small */
#define AHEAD 0.01      /* of a window, in which edges show how fast they come */
#define LONGER 1.1      /* times as long as a path that has felt a window as good as all of it */
#define ROUGH 0.1       /* of an error that lasts longer than its window: slopes are less precise than states */
#define ROUGHER 0.01    /* the same of a piece of another integrator, as UNEXPLAINED */
#define BESIDE 1e-14    /* of the time: rounding, by which counts rise before or behind their edges */
#define JUMP 1e-4       /* of slopes at neighbouring times: much more than they change there if they are steep */
#define ALREADY 1e-9    /* of the step: edges at its beginning, on which it stands */
#define TOPS 2          /* parabolas through a top: the second one is */
#define NARROWER 0.05   /* times as wide */
/* Distances from an edge, beside the time, between which a slope without a bound is each time less by GROWS: the middle
 * ones tell it from another corner in between. */
#define ROOT_AWAY {0, 1e-12, 1e-10, 1e-6}
#define ROOT_GROWS 3
#define ROOT_FELT 1e3    /* times the size: a smaller slope there is rounding */
#define MOST_WINDOWS 200 /* of a step: with more, it becomes shorter */
#define MOST_NOISE 16    /* windows shorter than the time resolution: what stays at an edge has them by rounding */
#define FINE 0.9         /* of the advance of a phase that a step may have */

static double *edges_at(Instance *c, double t, double *point, double *values) {
    evaluate_special(c, &c->model->tapes.edges, t, point, values);
    return values;
}

static double *edges_inside(Instance *c, double t, double *values) {
    double *point = c->vector + c->model->n_z;
    piece_at(c->model, c->piece, t, point);
    return edges_at(c, t, point, values);
}

static int differs(double before, double after) { return (before > 0) != (after > 0); }

/* Does the parabola through three equidistant values touch zero between them, where their signs are equal? `place`: of
 * its top, from -1 to 1. What begins at an edge has no sign there. */
static int touches(double first, double middle, double last, double *place) {
    double slope = last - first, bend = first - 2 * middle + last, extremum;
    *place = -0.5 * slope / bend;
    extremum = middle + 0.25 * slope * *place;
    if (!(fabs(*place) < 1)) return 0;
    return fabs(first) > AT_EDGE ? extremum * first < NEAR * first * first : extremum * last < 0;
}

/* What stays within `rest` of zero is no edge. */
static int any_edge(int begin, int end, const double *first, const double *middle, const double *last, double rest) {
    double place;
    for (int k = begin; k < end; k++) {
        if (max_of(fabs(first[k]), max_of(fabs(middle[k]), fabs(last[k]))) <= rest) continue;
        if (differs(first[k], middle[k]) || differs(middle[k], last[k]) ||
            touches(first[k], middle[k], last[k], &place))
            return 1;
    }
    return 0;
}

/* Notes a time at which an edge of the piece has another sign than at its ends, by edges there and in the middle: looks
 * at parts of the piece may all miss it. At the top of the parabola, and of a second one about that. */
static void find_top(Instance *c, const double *first, const double *middle, const double *last, double *now) {
    double begin = c->piece->begin, h = c->piece->end - begin, place;
    c->edge_top = INFINITY;
    for (int k = 0; k < c->model->settings->n_edges; k++) {
        double values[3] = {first[k], middle[k], last[k]}, half = 0.5 * h, top = begin + half;
        if (differs(middle[k], last[k])) continue;
        for (int round = 0; round < TOPS && touches(values[0], values[1], values[2], &place); round++) {
            top += place * half;
            half *= NARROWER;
            top = max_of(begin + half, min_of(top, begin + h - half));
            for (int n = 0; n < 3; n++) {
                values[n] = edges_inside(c, top + (n - 1) * half, now)[k];
                if (differs(last[k], values[n])) c->edge_top = min_of(c->edge_top, top + (n - 1) * half);
            }
        }
    }
}

static int any_between(const Instance *c, const double *before, const double *after) {
    for (int k = 0; k < c->model->settings->n_edges; k++)
        if (differs(before[k], after[k])) return 1;
    return 0;
}

/* The latest of the places, from 0 to 1, where straight lines between two points cross zero: that of the argument of a
 * kink, not that of a kink which is flat before it. */
static double place_between(const Instance *c, const double *before, const double *after) {
    double place = 0;
    for (int k = 0; k < c->model->settings->n_edges; k++)
        if (differs(before[k], after[k])) place = max_of(place, before[k] / (before[k] - after[k]));
    return place;
}

/* Are all edges between two points as good as zero now? `sizes` are their changes over a part. */
static int all_near(
    const Instance *c, const double *before, const double *after, const double *now, const double *sizes) {
    for (int k = 0; k < c->model->settings->n_edges; k++)
        if (differs(before[k], after[k]) && !(fabs(now[k]) <= 2 * ROUGHLY * sizes[k])) return 0;
    return 1;
}

/* The time just behind the first edge of the piece after a time, or infinity. At `low`,
 * edges have the values `before`, which become those of the time returned. The argument of a kink may have kinks: no
 * shape is taken for granted. */
static double next_edge(Instance *c, double low, double *before, int precisely) {
    const Piece *piece = c->piece;
    double h = piece->end - piece->begin, high = low, part = h / PARTS;
    size_t n = (size_t)c->model->tapes.edges.n_outputs, size = n * sizeof(double);
    double *after = before + n, *now = after + n, *sizes = now + n;
    for (int k = 1 + (int)((low - piece->begin) / part); k <= PARTS && high == low;) {
        double t = k < PARTS ? piece->begin + k * part : piece->end;
        if (low < c->edge_top && c->edge_top < t) t = c->edge_top;
        else k++;
        if (any_between(c, before, edges_inside(c, t, after))) high = t;
        else memcpy(before, after, size), low = high = t;
    }
    if (high == low) return INFINITY;
    for (size_t k = 0; k < n; k++) sizes[k] = fabs(before[k] - after[k]);
    for (int round = 0, near = 0; round < ROUNDS && high - low > LOCATED * h; round++) {
        double place = round % 4 == 3 || round >= SECANTS ? 0.5 : place_between(c, before, after);
        double t = low + place * (high - low) + (near ? ROUGHLY * part : 0);
        if (!(t < high)) t = 0.5 * (low + high);
        if (!(t > low)) t = low + min_of(ROUGHLY * part, 0.5 * (high - low));
        edges_inside(c, t, now);
        int behind = any_between(c, before, now);
        near = !precisely && all_near(c, before, after, now, sizes);
        memcpy(behind ? after : before, now, size);
        *(behind ? &high : &low) = t;
        if (behind && near) break;
    }
    memcpy(before, after, size);
    return high;
}

/* The last time before the first edge of the piece after `t`, or infinity; the time just behind it. */
double edge_ahead(Instance *c, double t, double *behind) {
    double *now = c->edges_middle, begin = c->piece->begin, h = c->piece->end - begin, most = 2 * LOCATED * h;
    size_t n = (size_t)c->model->tapes.edges.n_outputs;
    *behind = INFINITY;
    if (c->model->settings->n_edges == 0) return INFINITY;
    if (t == begin) { /* the first one of the piece */
        for (int k = 0; k < 3; k++) edges_inside(c, begin + 0.5 * k * h, now + (size_t)k * n);
        find_top(c, now, now + n, now + 2 * n, now + 3 * n);
    }
    edges_inside(c, t, now);
    *behind = next_edge(c, t, now, 1);
    return max_of(t, min_of(*behind - most, nextafter(*behind, t)));
}

/* Do slopes differ at two neighbouring times of the piece? Edges tell where a step of a count is but for rounding. */
int jumps_between(Instance *c, double before, double behind) {
    const Model *m = c->model;
    double *point = c->vector + m->n_z, *first = c->edge_slopes, *last = c->edge_change;
    double beside = BESIDE * max_of(1, fabs(behind));
    int any = 0;
    for (int side = 0; side < 2; side++) {
        double t = side == 0 ? max_of(before - beside, c->piece->begin) : min_of(behind + beside, c->piece->end);
        edges_inside(c, t, c->edges_middle + side * m->tapes.edges.n_outputs);
        if (!solve_implicit(c, t, point, 1)) return 0;
        evaluate_special(c, &m->tapes.rates, t, point, side == 0 ? first : last);
    }
    for (int k = 0; k < m->n_x; k++)
        any |= fabs(last[k] - first[k]) > JUMP * (m->nominals[k] + fabs(first[k]) + fabs(last[k]));
    return any;
}

/* Has a slope no bound at one of two neighbouring times? It grows the more, the nearer to them. */
int is_steep(Instance *c, double before, double behind) {
    const Model *m = c->model;
    const double away[] = ROOT_AWAY;
    double *point = c->vector + m->n_z, *at = c->edge_slopes, *there = c->edge_change, *grown = c->changes;
    for (int side = -1; side <= 1; side += 2) {
        double t = side < 0 ? before : behind;
        for (int k = 0; k < 4; k++) {
            double way = side * away[k] * max_of(1, fabs(t));
            piece_at(m, c->piece, t, point);
            for (int i = 0; i < m->n_x && k > 0; i++) point[i] += way * at[i];
            if (!solve_implicit(c, t + way, point, 1)) return 0;
            evaluate_special(c, &m->tapes.rates, t + way, point, k == 0 ? at : there);
            for (int i = 0; i < m->n_x && k > 0; i++) {
                double slope = fabs(there[i] - at[i]) / away[k], felt = ROOT_FELT * (m->nominals[i] + fabs(at[i]));
                int bends = k > 1 && slope * away[k] > 2 * grown[i] * away[k - 1]; /* it is no step nearby */
                int grows = k == 1 || (bends && grown[i] > ROOT_GROWS * slope && (k == 3 || slope > felt));
                if (k == 3 && grows) return 1;
                grown[i] = grows ? slope : 0;
            }
        }
    }
    return 0;
}

/* Do Jacobians differ at two neighbouring times, so that derivatives feel it in a step of the piece? */
int is_corner(Instance *c, double before, double behind, double *room) {
    const Model *m = c->model;
    const QrPattern *a = &m->step;
    double *point = c->vector + m->n_z, h = c->piece->end - c->piece->begin;
    double *sides[] = {room, c->jacobian};
    for (int side = 0; side < 2; side++) {
        piece_at(m, c->piece, side ? behind : before, point);
        if (!solve_implicit(c, side ? behind : before, point, 1)) return 0;
        evaluate_special(c, &m->tapes.jacobian, side ? behind : before, point, sides[side]);
    }
    for (int column = 0, k = 0; k < m->n_jacobian; k++) {
        int place = m->jacobian_to_step[k];
        while (column + 1 < a->size && a->colind[column + 1] <= place) column++;
        while (a->colind[column] > place) column--;
        double size = h * m->nominals[column] / m->nominals[a->row[place]];
        if (fabs(sides[1][k] - sides[0][k]) * (column < m->n_x && a->row[place] < m->n_x ? size : h) >
            c->state.tolerance)
            return 1;
    }
    return 0;
}

/* How many times as long as the path a run stays, whose slopes the path has not felt: by the edges near a point of the
 * path, at which they come later, or never. At most as long as the step. */
static double times_longer(Instance *c, double t, double window, const double *point, const double *slopes) {
    const Model *m = c->model;
    size_t n = (size_t)m->tapes.edges.n_outputs;
    double *here = c->edges_middle + n, *ahead = here + n, *felt = ahead + n, *moved = c->edge_moved;
    double most = (c->piece->end - c->piece->begin) / window, h = AHEAD * window, longer = 1;
    if (h <= BESIDE * max_of(1, fabs(t)) || most * LOCATED > AHEAD) return 1; /* edges that are one */
    memcpy(moved, point, (size_t)m->n_unknowns * sizeof(double));
    edges_at(c, t, moved, here);
    for (int k = 0; k < m->n_x; k++) moved[k] += h * slopes[k];
    edges_at(c, t + h, moved, felt);
    piece_at(m, c->piece, t + h, moved);
    edges_at(c, t + h, moved, ahead);
    for (int k = 0; k < m->settings->n_slope_edges; k++) {
        double way = ahead[k] - here[k], slow = (felt[k] - here[k]) / way;
        if (fabs(way) > AHEAD * fabs(here[k])) longer = max_of(longer, slow * most > 1 ? 1 / slow : most);
    }
    return longer;
}

/* Adds what slopes on the piece's path change from one time to another, by Gauss's rule of order four, and how many
 * times as long it takes, both nodes together. */
static int add_slopes(Instance *c, double begin, double end, double *change, double window, double *longer) {
    const Model *m = c->model;
    double *point = c->vector + m->n_z, *slopes = c->edge_slopes;
    for (int g = -1; g <= 1; g += 2) {
        double t = 0.5 * (begin + end) + g * 0.28867513459481287 * (end - begin);
        piece_at(m, c->piece, t, point);
        if (!solve_implicit(c, t, point, 1)) return 0;
        evaluate_special(c, &m->tapes.rates, t, point, slopes);
        for (int k = 0; k < m->n_x; k++) change[k] += 0.5 * (end - begin) * slopes[k];
        *longer += times_longer(c, t, window, point, slopes);
    }
    return 1;
}

/* What the states change in a window otherwise than by their slopes, in tolerances; how many times as long it takes.
 * The matrix of the step takes away what decays in it, as from the estimate of its error, but costs more than the
 * rest. */
static double window_error(Instance *c, double begin, double end, int parts, int with_matrix, double *times) {
    const Model *m = c->model;
    double *point = c->vector + m->n_z, *change = c->edge_change, h = c->piece->end - c->piece->begin, longer = 0;
    memset(change, 0, (size_t)m->n_unknowns * sizeof(double));
    for (int k = 0; k < parts; k++) {
        double first = begin + (end - begin) * k / parts, last = begin + (end - begin) * (k + 1) / parts;
        if (!add_slopes(c, first, last, change, end - begin, &longer)) return 0;
    }
    *times = longer / (2 * parts);
    piece_at(m, c->piece, begin, point);
    for (int k = 0; k < m->n_x; k++) change[k] += point[k];
    piece_at(m, c->piece, end, point);
    for (int k = 0; k < m->n_x; k++) change[k] -= point[k];
    if (with_matrix) {
        for (int k = 0; k < m->n_x; k++) change[k] *= step_diagonal(h);
        solve_step(c, change);
    }
    return max_of(1, *times * (takes_panels(c) ? ROUGHER : ROUGH)) *
           error_norm(c, c->piece->points, last_of(m, c->piece), change);
}

/* The matrix of a step over a piece of another integrator, at one of its ends. */
static int factor_piece(Instance *c, int at_end) {
    Piece *piece = c->piece;
    double t = at_end ? piece->end : piece->begin;
    return factor_at(c, t, at_end ? last_of(c->model, piece) : piece->points, piece->end - piece->begin);
}

/* Is it more than a step, or another integrator in a part of a piece, explains? Where it seems so, the window is taken
 * in parts: its slopes may be curved. */
static int is_more(Instance *c, double begin, double end, int with_matrix) {
    double h = c->piece->end - c->piece->begin, most = UNSEEN + takes_panels(c) * UNEXPLAINED * (end - begin) / h;
    double longer, error = window_error(c, begin, end, 1, with_matrix, &longer);
    if (error <= most && longer <= LONGER) return 0;
    return window_error(c, begin, end, CURVED, with_matrix, &longer) > most;
}

/* Has the step, or another integrator, not seen a window? A piece that begins on the edge of a stiff one, or ends
 * there, takes it all for what decays: at one end it does not. */
static int is_unseen(Instance *c, double begin, double end) {
    if (!takes_panels(c)) return is_more(c, begin, end, 1);
    if (!is_more(c, begin, end, 0)) return 0;
    for (int at_end = 0; at_end < 2; at_end++)
        if (factor_piece(c, at_end) && is_more(c, begin, end, 1)) return 1;
    return 0;
}

/* Guards at a time of the piece. */
static const double *guards_inside(Instance *c, double t) {
    double *point = c->vector + c->model->n_z;
    piece_at(c->model, c->piece, t, point);
    if (c->model->n_guards > 0) evaluate_special(c, &c->model->tapes.guards, t, point, c->edge_guards);
    return c->edge_guards;
}

/* Notes guards that are positive at an end of the piece, or cannot fire. */
static void note_positive(Instance *c, double t) {
    const double *guards = guards_inside(c, t);
    for (int g = 0; g < c->model->n_guards; g++) c->positive[g] |= guards[g] > 0 || !guard_active(c, g);
}

/* Is a guard positive at a time inside the piece that is not at its ends, and is that more than rounding? */
static int has_risen(Instance *c, double t) {
    int n = c->model->n_guards, any = 0;
    const double *guards = guards_inside(c, t), *rounding;
    for (int g = 0; g < n; g++) any |= c->kinds[g] = guards[g] > 0 && !c->positive[g];
    if (!any) return 0;
    make_part(c, &c->model->tapes.guards, c->kinds, n);
    rounding = rounding_of_guards(c, c->piece, t);
    for (int g = 0; g < n; g++)
        if (c->kinds[g] && guards[g] > rounding[g]) return 1;
    return 0;
}

/* Goes through the windows of a step and returns the smaller length that it must have, or infinity. */
static double judge_windows(Instance *c, double least, int of_slopes, int of_guards, int precisely) {
    double begin = c->piece->begin, h = c->piece->end - begin, landing = h, *now = c->edges_middle;
    double resolved = begin + TIME_RESOLUTION * max_of(1, fabs(begin));
    least = max_of(max_of(least, ALREADY * h), c->lands ? resolved - begin : 0); /* rounding brings edges back */
    int unseen = 0, noise = 0, windows = 0;
    memcpy(now, c->edges, (size_t)c->model->tapes.edges.n_outputs * sizeof(double));
    for (double before = begin, edge = begin; edge < c->piece->end && !(unseen && landing < h); before = edge) {
        edge = min_of(next_edge(c, before, now, precisely), c->piece->end);
        if (edge - before < resolved - begin && ++noise > MOST_NOISE) { /* windows become twice as long, each time */
            edge = min_of(before + ldexp(resolved - begin, noise - MOST_NOISE), c->piece->end);
            edges_inside(c, edge, now);
        }
        if (++windows > MOST_WINDOWS) return 0.5 * h;
        double between = 0.5 * (before + edge);
        if (of_guards && between > resolved && has_risen(c, between)) return between - begin;
        if (of_guards && edge > resolved && has_risen(c, edge)) return edge - begin;
        unseen |= of_slopes && (c->lands || is_unseen(c, before, edge));
        if (landing == h && edge - begin > least) landing = edge - begin;
    }
    if (unseen && landing >= h && takes_panels(c)) return 0.5 * h; /* the piece ends at its only edge */
    return unseen && landing < h ? landing * (1 + BEHIND) : INFINITY;
}

/* Half of a piece without edges, if its slopes do not explain how its states change; or infinity. Steps of another
 * integrator may be longer than pieces: one that goes over a force shows it in pieces beside its edges, too. */
static double explained_length(Instance *c) {
    double begin = c->piece->begin, end = c->piece->end;
    int judged = takes_panels(c) && c->model->settings->n_slope_edges > 0;
    return judged && is_unseen(c, begin, end) ? 0.5 * (end - begin) : INFINITY;
}

/* Are all edges farther away than they come by their changes in this step, and in the one before? */
static int out_of_reach(const Instance *c, double h) {
    int n = c->model->tapes.edges.n_outputs;
    const double *first = c->edges, *last = first + n, *before = last + n;
    for (int k = 0; k < c->model->settings->n_edges && c->edges_kept > 0; k++) {
        double way = max_of(fabs(last[k] - first[k]), fabs(first[k] - before[k]) * h / c->edges_kept);
        if (differs(first[k], last[k]) || (way > 0 && min_of(fabs(first[k]), fabs(last[k])) < REACH * way)) return 0;
    }
    return c->edges_kept > 0;
}

/* Judges an accepted step. Returns the smaller length that it must have, or infinity: to the first edge, if it has not
 * seen a window between edges, or as waves ask for, none below `least`; `most` is how long the next one may be. */
double seen_length(Instance *c, double least, double *most) {
    const Model *m = c->model;
    int n = m->tapes.edges.n_outputs, n_edges = m->settings->n_edges, of_slopes, of_guards;
    double begin = c->piece->begin, h = c->piece->end - begin, advance = 0;
    double *first = c->edges, *last = c->edges + n, *middle = c->edges_middle;
    c->edgeless = n_edges == 0;
    if (!c->edges_valid) edges_at(c, begin, c->piece->points, first), c->edges_kept = 0;
    c->edges_valid = 1;
    edges_at(c, c->piece->end, last_of(m, c->piece), last);
    if (n > n_edges) edges_inside(c, begin + 0.5 * h, middle);
    for (int k = n_edges; k < n; k++) /* a phase may jump, but not in both halves of a step */
        advance = max_of(advance, 2 * min_of(fabs(last[k] - middle[k]), fabs(middle[k] - first[k])));
    *most = advance > 0 ? FINE * h / advance : INFINITY;
    /* What advances in a shorter time jumps. */
    if (advance > 1 && h > TIME_RESOLUTION * max_of(1, fabs(begin))) return *most;
    if (n_edges == 0) return INFINITY;
    if (out_of_reach(c, h)) return c->edgeless = 1, explained_length(c);
    if (n == n_edges) edges_inside(c, begin + 0.5 * h, middle);
    /* Steps that land would do so at each rounding of what rests at an edge. */
    of_slopes = any_edge(0, m->settings->n_slope_edges, first, middle, last, c->lands ? AT_EDGE : 0);
    of_guards = any_edge(m->settings->n_slope_edges, n_edges, first, middle, last, 0);
    if (!of_slopes && !of_guards) return explained_length(c);
    find_top(c, first, middle, last, middle + n);
    memset(c->positive, 0, (size_t)m->n_guards);
    if (of_guards) note_positive(c, begin), note_positive(c, c->piece->end);
    if (!isfinite(judge_windows(c, least, of_slopes, of_guards, 0))) return INFINITY;
    return judge_windows(c, least, of_slopes, of_guards, 1);
}

/* Is there an edge within the piece? Where slopes jump, no step is short enough for its error to be small. */
int is_over_edge(Instance *c) {
    double *first = edges_at(c, c->piece->begin, c->piece->points, c->edges_middle);
    double *last = first + c->model->tapes.edges.n_outputs;
    return any_between(c, first, edges_at(c, c->piece->end, last_of(c->model, c->piece), last));
}

/* The step has been taken. */
void keep_edges(Instance *c) {
    size_t n = (size_t)c->model->tapes.edges.n_outputs;
    memcpy(c->edges + 2 * n, c->edges, n * sizeof(double));
    memcpy(c->edges, c->edges + n, n * sizeof(double));
    c->edges_kept = c->edges_valid ? c->piece->end - c->piece->begin : 0;
}
