// Draws one chart: medians with quartile bands of one group's methods over the steps.
//
// dygraphs puts series names into the page as HTML. It never sees a real name here: series are
// called s0, s1, ..., and names are written by page.js as text only.
'use strict';

const relignCurves = (() => {
  // Okabe and Ito's colours, told apart by colour-blind readers, without their yellow, which is
  // invisible on white. Once they are used up, a dash pattern tells the next round apart.
  const LIGHT = ['#0072B2', '#D55E00', '#009E73', '#B5598E', '#B97F00', '#2E94CC', '#3A3F47'];
  const DARK = ['#4BA9E6', '#FF8A45', '#2CC79A', '#E39AC4', '#F0B93A', '#9AD4FF', '#D5D9DE'];
  const DASHES = [null, [8, 4], [2, 3], [10, 3, 2, 3], [14, 4], [5, 2, 1, 2, 1, 2]];
  const ORACLE_DASH = [4, 4];

  // Colour and dash of every method, the same in all charts.
  function styles(methods, dark) {
    const colours = dark ? DARK : LIGHT;
    let next = 0;
    return methods.map((method) => {
      if (method.oracle) return {colour: dark ? '#aab2bc' : '#6a7380', dash: ORACLE_DASH};
      const style = {colour: colours[next % colours.length], dash: DASHES[Math.floor(next / colours.length) % DASHES.length]};
      next += 1;
      return style;
    });
  }

  // Rows for dygraphs: [step, [low, middle, high] or nulls for each method]. On a logarithmic axis
  // zero has no place: a lower quartile of zero is drawn at the smallest value of the chart.
  function rows(group, methods, track, log) {
    const curves = methods.map((method) => group.curves.find((curve) => curve.method === method.name));
    let last = 0, smallest = Infinity;
    for (const curve of curves) {
      if (!curve || !curve.tracks[track]) continue;
      const {median, q25} = curve.tracks[track];
      last = Math.max(last, curve.first_step + median.length - 1);
      for (const value of [...median, ...q25]) if (value > 0) smallest = Math.min(smallest, value);
    }
    const table = [];
    for (let step = 0; step <= last; ++step) {
      table.push([step, ...curves.map((curve) => {
        const values = curve && curve.tracks[track];
        const at = curve ? step - curve.first_step : -1;
        if (!values || at < 0 || at >= values.median.length || values.median[at] === null) return null;
        if (log && !(values.median[at] > 0)) return null;
        return [log ? Math.max(values.q25[at], smallest) : values.q25[at], values.median[at], values.q75[at]];
      })]);
    }
    return table;
  }

  // Three digits without an exponent where people expect none.
  function number(value) {
    if (value === null || !isFinite(value)) return '-';
    if (value === 0) return '0';
    const size = Math.abs(value);
    if (size < 1e-4 || size >= 1e6) return value.toExponential(2);
    return value.toFixed(Math.max(0, 2 - Math.floor(Math.log10(size))));
  }

  function tick(value) {
    return value === 0 ? '0' : String(parseFloat(value.toPrecision(3)));
  }

  // There is nothing between two steps, so there is no tick either.
  function wholeSteps(...range) {
    return Dygraph.numericTicks(...range).filter((mark) => Number.isInteger(mark.v));
  }

  class Chart {
    // view: {track, log, bands, visible: [bool], styles, dark}; onPoint(methodIndex, step) or onPoint(null).
    constructor(element, group, methods, view, onPoint) {
      this.group = group;
      this.methods = methods;
      this.names = methods.map((_, i) => 's' + i);
      this.graph = new Dygraph(element, rows(group, methods, view.track, view.log), {
        labels: ['step', ...this.names],
        customBars: true,
        legend: 'never',
        xlabel: 'step',
        xRangePad: 4,
        yRangePad: 6,
        animateBackgroundFade: false,
        highlightCircleSize: 3,
        highlightSeriesOpts: {strokeWidth: 3, highlightCircleSize: 4},
        highlightSeriesBackgroundAlpha: 0.6,
        highlightCallback: (event, step, points, row, name) => onPoint(this.names.indexOf(name), step),
        unhighlightCallback: () => onPoint(null),
        ...this.options(view),
      });
    }

    options(view) {
      // dygraphs complains about a logarithmic axis that has nothing on it.
      const log = view.log && this.methods.some((method, i) => view.visible[i] &&
        this.group.curves.some((curve) => curve.method === method.name && curve.tracks[view.track] &&
                                          curve.tracks[view.track].median.some((value) => value > 0)));
      const series = {};
      this.names.forEach((name, i) => { series[name] = {strokePattern: view.styles[i].dash}; });
      const plotters = Dygraph.Plotters;
      return {
        colors: view.styles.map((style) => style.colour),
        visibility: view.visible,
        logscale: log,
        includeZero: !log,
        fillAlpha: 0.16,
        strokeWidth: 1.7,
        series,
        plotter: view.bands ? [plotters.errorPlotter, plotters.linePlotter] : plotters.linePlotter,
        gridLineColor: view.dark ? '#363c44' : '#e3e6ea',
        axisLineColor: view.dark ? '#59616b' : '#b4bac2',
        highlightSeriesBackgroundColor: view.dark ? '#1d2126' : '#f7f8fa',
        axes: {
          x: {ticker: wholeSteps, axisLabelWidth: 30, pixelsPerLabel: 34},
          y: {axisLabelFormatter: tick, axisLabelWidth: 46},
        },
      };
    }

    update(view) {
      this.graph.updateOptions({...this.options(view), file: rows(this.group, this.methods, view.track, view.log)});
    }

    highlight(index) {
      if (index === null) this.graph.clearSelection();
      else this.graph.setSelection(false, this.names[index]);
    }

    resize() { this.graph.resize(); }
  }

  return {Chart, styles, number};
})();
