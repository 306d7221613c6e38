// A walk through something that is halved as often as it has to be, from front to back.

// Part `index` of `parts` equal ones; behind the last one where index >= parts.
struct Portion {
    float index;
    float parts;
};

Portion halved(Portion portion) {
    return Portion(2.0 * portion.index, 2.0 * portion.parts);
}

// The next one, as great as it may be: two halves that lie behind are one.
Portion after(Portion portion) {
    Portion next = Portion(portion.index + 1.0, portion.parts);
    while (next.parts > 1.0 && mod(next.index, 2.0) == 0.0) {
        next.index *= 0.5;
        next.parts *= 0.5;
    }
    return next;
}
