// An interactive chart: medians with bands of the methods of one group, against images or seconds.
//
// dygraphs inserts series names as HTML. To prevent injection, series are called s0, s1, ..., and real names are written as
// text only.
'use strict';

const relignCurves = (() => {
  // Colours of Okabe and Ito, distinguishable with colour blindness, without their yellow, which is invisible on white.
  // They repeat with the next dash pattern. The static figures use the same (chart_csv.cpp, page.css).
  const LIGHT = ['#0072B2', '#D55E00', '#009E73', '#B5598E', '#B97F00', '#2E94CC', '#3A3F47'];
  const DARK = ['#4BA9E6', '#FF8A45', '#2CC79A', '#E39AC4', '#F0B93A', '#9AD4FF', '#D5D9DE'];
  const DASHES = [null, [8, 4], [2, 3], [10, 3, 2, 3], [14, 4], [5, 2, 1, 2, 1, 2]];
  const ORACLE_DASH = [4, 4];
  const LABEL_HEIGHT = 12;
  const NOISE_FREE = ['recommended', 'commanded', 'recommended_best', 'recommended_current'];  // tracks to which floor and spec apply
  const AXIS_TITLES = {step: 'images', machine_seconds: 'machine time, s', algorithm_seconds: 'compute time, s'};

  // Colour and dash of each method, the same in all charts.
  function styles(methods, dark) {
    const colours = dark ? DARK : LIGHT;
    return methods.map(({oracle, style}) => oracle
      ? {colour: dark ? '#aab2bc' : '#6a7380', dash: ORACLE_DASH}
      : {colour: colours[style % colours.length], dash: DASHES[Math.floor(style / colours.length) % DASHES.length]});
  }

  // A name may denote different methods under different protocols.
  const curveIn = (group, method) => (method.protocol && method.protocol !== group.protocol ? undefined
    : group.curves.find((curve) => curve.method === method.name));

  const stepAt = (curve, i) => (curve.steps ? curve.steps[i] : curve.first_step + i);
  const clockAt = (curve, clock, i) => (clock === 'step' ? stepAt(curve, i) : (curve[clock] || [])[i]);

  // Bands are computed at some steps only and interpolated between them, linearly in the chart's scale.
  function joined(values, log) {
    const known = [];
    values.forEach((value, i) => { if (value !== null) known.push(i); });
    const to = (value) => (log && value > 0 ? Math.log(value) : value);
    return values.map((value, i) => {
      if (value !== null || known.length === 0) return value;
      const after = known.find((k) => k > i), before = known.filter((k) => k < i).pop();
      if (after === undefined || before === undefined) return null;
      const share = (i - before) / (after - before), bothPositive = values[before] > 0 && values[after] > 0;
      if (!log || !bothPositive) return values[before] + share * (values[after] - values[before]);
      return Math.exp(to(values[before]) + share * (to(values[after]) - to(values[before])));
    });
  }

  // A method's points [{x, low, middle, high, place}], in order of x.
  function points(curve, view) {
    const track = curve && curve.tracks[view.track];
    if (!track) return [];
    const [lows, highs] = view.bands === 'interval' && track.lo95 ? [joined(track.lo95, view.log), joined(track.hi95, view.log)]
      : view.bands === 'quartiles' && track.q25 ? [track.q25, track.q75] : [track.median, track.median];
    const list = [];
    track.median.forEach((middle, place) => {
      const x = clockAt(curve, view.clock, place);
      if (middle === null || x === null || x === undefined || (view.logx && !(x > 0)) || (view.log && !(middle > 0))) return;
      const low = lows[place] === null ? middle : lows[place], high = highs[place] === null ? middle : highs[place];
      list.push({x, low: Math.min(low, middle), middle, high: Math.max(high, middle), place});
    });
    return list;
  }

  // Three significant digits, without an exponent between 1e-4 and 1e6.
  function number(value) {
    if (value === null || value === undefined || !isFinite(value)) return '-';
    if (value === 0) return '0';
    const size = Math.abs(value);
    if (size < 1e-4 || size >= 1e6) return value.toExponential(2);
    return value.toFixed(Math.max(0, 2 - Math.floor(Math.log10(size))));
  }

  function tick(value) {
    return value === 0 ? '0' : String(parseFloat(value.toPrecision(3)));
  }

  // Ticks at whole steps only.
  function wholeSteps(...range) {
    return Dygraph.numericTicks(...range).filter((mark) => Number.isInteger(mark.v));
  }

  // Positions of labels near `wanted` without overlap, within top and bottom; the first ones have priority.
  function spread(wanted, top, bottom) {
    const room = Math.floor((bottom - top) / LABEL_HEIGHT) + 1;
    const kept = wanted.slice(0, Math.max(0, room)).sort((a, b) => a.y - b.y);
    let least = top;
    for (const label of kept) { label.y = Math.max(label.y, least); least = label.y + LABEL_HEIGHT; }
    let most = bottom;
    for (const label of kept.reverse()) { label.y = Math.min(label.y, most); most = label.y - LABEL_HEIGHT; }
    return kept;
  }

  class Chart {
    // view: {track, clock, log, logx, bands, visible: [bool], styles, dark}; onPoint(methodIndex, place) or onPoint(null).
    constructor(element, group, methods, view, onPoint) {
      this.element = element;
      this.group = group;
      this.methods = methods;
      this.names = methods.map((_, i) => 's' + i);
      this.ends = Object.assign(document.createElement('div'), {className: 'ends'});
      this.prepare(view);
      const onHighlight = (event, x, shown, row, name) => {
        const index = this.names.indexOf(name);
        const found = (this.points[index] || []).find((point) => point.x === x);
        onPoint(found ? index : null, found && found.place);
      };
      this.graph = new Dygraph(element, this.rows(), {
        labels: ['x', ...this.names],
        customBars: true,
        connectSeparatedPoints: true,
        legend: 'never',
        xRangePad: 4,
        animateBackgroundFade: false,
        highlightCircleSize: 3,
        highlightSeriesOpts: {strokeWidth: 3, highlightCircleSize: 4},
        highlightSeriesBackgroundAlpha: 0.6,
        highlightCallback: onHighlight,
        unhighlightCallback: () => onPoint(null),
        underlayCallback: (context, area, graph) => this.drawLevels(context, area, graph),
        drawCallback: (graph) => this.label(graph),
        ...this.options(),
      });
      element.append(this.ends);
    }

    prepare(view) {
      this.view = view;
      const curveOf = (method) => curveIn(this.group, method);
      this.points = this.methods.map((method) => points(curveOf(method), view));
      // dygraphs logs an error for a logarithmic axis without data.
      this.log = view.log && this.points.some((list, i) => view.visible[i] && list.length > 0);
      this.logx = view.logx && this.log === view.log && this.points.some((list) => list.length > 0);
      const floor = this.group.floor || {};
      this.levels = NOISE_FREE.includes(view.track)
        ? [[floor.own_optimum, [7, 4], 'own optimum', 'left'], [floor.next_image, [2, 3], 'bound of one more image', 'center'],
           [this.group.spec, [10, 3], 'spec', 'right']].filter(([y]) => Number.isFinite(y) && (!this.log || y > 0))
        : [];
    }

    // Rows for dygraphs: [x, [low, middle, high] or null for each method].
    rows() {
      let smallest = Infinity;
      for (const list of this.points) for (const {low, middle} of list) for (const y of [low, middle]) if (y > 0) smallest = Math.min(smallest, y);
      const byX = new Map();
      this.points.forEach((list, i) => {
        for (const {x, low, middle, high} of list) {
          if (!byX.has(x)) byX.set(x, [x, ...this.names.map(() => null)]);
          byX.get(x)[i + 1] = [this.log ? Math.max(low, smallest) : low, middle, high];
        }
      });
      const table = [...byX.values()].sort((a, b) => a[0] - b[0]);
      return table.length > 0 ? table : [[1, ...this.names.map(() => null)]];
    }

    // Includes reference lines near the data.
    valueRange() {
      let low = Infinity, high = -Infinity;
      const add = (y) => { if (Number.isFinite(y) && (!this.log || y > 0)) { low = Math.min(low, y); high = Math.max(high, y); } };
      this.points.forEach((list, i) => { if (this.view.visible[i]) for (const point of list) { add(point.low); add(point.middle); add(point.high); } });
      if (!(low <= high)) return this.log ? null : [0, 1];
      for (const [y] of this.levels) if (y > low / 10 && y < high * 3) add(y);
      if (this.log) return [low / 1.12, high * 1.12];
      return [Math.min(0, low), high * 1.06 || 1];
    }

    options() {
      const view = this.view, series = {};
      this.names.forEach((name, i) => { series[name] = {strokePattern: view.styles[i].dash}; });
      const plotters = Dygraph.Plotters;
      return {
        colors: view.styles.map((style) => style.colour),
        visibility: view.visible,
        logscale: this.log,
        valueRange: this.valueRange(),
        xlabel: AXIS_TITLES[view.clock],
        rightGap: Math.min(110, Math.round(this.element.clientWidth * 0.2)),
        fillAlpha: 0.16,
        strokeWidth: 1.7,
        series,
        plotter: view.bands === 'none' ? plotters.linePlotter : [plotters.errorPlotter, plotters.linePlotter],
        gridLineColor: view.dark ? '#363c44' : '#e3e6ea',
        axisLineColor: view.dark ? '#59616b' : '#b4bac2',
        highlightSeriesBackgroundColor: view.dark ? '#1d2126' : '#f7f8fa',
        axes: {
          x: {logscale: this.logx, ticker: view.clock === 'step' ? wholeSteps : Dygraph.numericTicks,
              axisLabelFormatter: tick, axisLabelWidth: 34, pixelsPerLabel: this.logx ? 20 : 34},
          y: {axisLabelFormatter: tick, axisLabelWidth: 46},
        },
      };
    }

    drawLevels(context, area, graph) {
      context.save();
      context.strokeStyle = context.fillStyle = this.view.dark ? '#9aa4b0' : '#5b6470';
      context.font = '10px sans-serif';
      for (const [value, dash, words, side] of this.levels) {
        const y = graph.toDomYCoord(value);
        if (!(y >= area.y && y <= area.y + area.h)) continue;
        context.setLineDash(dash);
        context.beginPath();
        context.moveTo(area.x, y);
        context.lineTo(area.x + area.w, y);
        context.stroke();
        context.textAlign = side;
        const x = {left: area.x + 4, center: area.x + area.w / 2, right: area.x + area.w - 4}[side];
        context.fillText(words, x, y - 3 < area.y + 9 ? y + 10 : y - 3);
      }
      context.restore();
    }

    // Names at the ends of the lines, as many as have room; the legend lists all.
    label(graph) {
      const area = graph.getArea(), [from, to] = graph.xAxisRange(), wanted = [];
      this.points.forEach((list, i) => {
        if (!this.view.visible[i]) return;
        const last = list.filter((point) => point.x >= from && point.x <= to).pop();
        if (!last) return;
        const y = graph.toDomYCoord(last.middle);
        if (y >= area.y - 1 && y <= area.y + area.h + 1) wanted.push({i, y, end: last.middle});
      });
      wanted.sort((a, b) => a.end - b.end);  // best first
      this.ends.replaceChildren(...spread(wanted, area.y + 4, area.y + area.h - 4).map(({i, y}) => {
        const name = Object.assign(document.createElement('bdi'), {textContent: this.methods[i].name, title: this.methods[i].label || this.methods[i].name});
        Object.assign(name.style, {left: area.x + area.w + 5 + 'px', top: y - 8 + 'px', color: this.view.styles[i].colour});
        return name;
      }));
    }

    update(view) {
      const clock = this.clock;
      this.clock = view.clock + view.logx;
      this.prepare(view);
      // A zoom does not carry over to another horizontal axis.
      this.graph.updateOptions({...this.options(), file: this.rows(), ...(clock === this.clock ? {} : {dateWindow: null})});
    }

    highlight(index) {
      if (index === null) this.graph.clearSelection();
      else this.graph.setSelection(false, this.names[index]);
    }

    resize() { this.graph.resize(); }
  }

  return {Chart, styles, number, curveIn, stepAt};
})();
