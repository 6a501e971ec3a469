"use strict";
/* What the scripts of pages share: that of a drive (show/browser/page.js) and that of a report (report/page/page.js). */
function element(tag, properties, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

function short(value, digits = 5) {
  const size = Math.abs(value), plain = size === 0 || (size < 1e6 && size >= 1e-4);
  return plain ? String(Number(value.toPrecision(digits))) : value.toExponential(digits - 2).replace(/\.?0+e/, "e");
}

/* Round values from low to high, about `count` of them. */
function ticks(low, high, count) {
  const raw = (high - low) / count || 1, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((k) => k * power >= raw * (1 - 1e-9)), first = Math.ceil(low / step - 1e-9);
  const length = Math.max(0, Math.floor(high / step + 1e-9) - first + 1);
  return Array.from({ length }, (_, k) => Number(((first + k) * step).toPrecision(12)));
}
