// What all scripts of the page share. Text from the results is only written with textContent.
'use strict';

const relign = (() => {
  const byId = (id) => document.getElementById(id);

  function make(tag, properties = {}, ...children) {
    const element = Object.assign(document.createElement(tag), properties);
    element.append(...children);
    return element;
  }

  // Attributes without a value are left out; coordinates are rounded to tenths of a pixel.
  function svg(tag, attributes, ...children) {
    const element = document.createElementNS('http://www.w3.org/2000/svg', tag);
    for (const [name, value] of Object.entries(attributes))
      if (value !== null && value !== '') element.setAttribute(name, typeof value === 'number' ? Math.round(10 * value) / 10 : value);
    element.append(...children);
    return element;
  }

  const options = (list) => list.map(([value, textContent]) => make('option', {value, textContent}));

  const known = (value) => Number.isFinite(value);

  // Three significant digits, without an exponent between 1e-4 and 1e6.
  function number(value) {
    if (!known(value)) return '-';
    if (value === 0) return '0';
    const size = Math.abs(value);
    if (size < 1e-4 || size >= 1e6) return value.toExponential(2);
    return value.toFixed(Math.max(0, 2 - Math.floor(Math.log10(size))));
  }

  return {byId, make, svg, options, known, number};
})();
