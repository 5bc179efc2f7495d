// The trial replay: the captures of a trial with pose and error, then the image at the final pose and the reference. All
// pictures are embedded in the page; names are written as text only.
'use strict';

const relignReplay = (() => {
  const TICK_MS = 700;
  const WHY = {median: 'median trial', worst: 'worst trial', best: 'best trial'};
  const {byId, make, svg, options, number} = relign;

  function show(element, {picture, x, y, width, height}) {
    element.setAttribute('viewBox', [x, y, width, height].join(' '));
    element.querySelector('use').setAttribute('href', '#picture-' + picture);
  }

  function newPicture(place) {
    const element = svg('svg', {}, svg('use', {}));
    show(element, place);
    return element;
  }

  const whole = (picture) => ({...picture, x: 0, y: 0});

  // The pictures in order: captures of the film, final pose, reference.
  function viewsOf(trial, reference) {
    const views = trial.frames.map((frame, i) => ({
      label: String(frame.step), title: 'image ' + frame.step, frame,
      place: {picture: trial.picture, x: i * trial.tile, y: 0, width: trial.tile, height: trial.tile}}));
    if (trial.end) views.push({label: 'final', title: 'at the recommended pose, after image ' + trial.end_step, place: whole(trial.end)});
    if (reference) views.push({label: 'reference', title: 'the reference', place: whole(reference)});
    return views;
  }

  function facts(frame, axes) {
    if (!frame) return [];
    const errors = make('table', {}, make('tbody', {}, ...[
      ['error at this pose', frame.commanded, 'noise-free, at the commanded pose'],
      ['error at the recommended pose', frame.recommended, 'noise-free, at the pose that the method recommends after this step'],
      ['measured error', frame.measured, 'of this image, noise included'],
      ['machine time, s', frame.seconds, 'since the start'],
    ].map(([name, value, title]) => make('tr', {title}, make('th', {scope: 'row', textContent: name}), make('td', {className: 'number', textContent: number(value)})))));
    const pose = make('table', {}, make('thead', {}, make('tr', {}, make('th', {textContent: 'axis'}), make('th', {className: 'number', textContent: 'true pose'}),
      make('th', {className: 'number', textContent: 'commanded', title: 'share of the travel'}))),
    make('tbody', {}, ...frame.commanded_pose.map((commanded, i) => {
      const axis = axes && axes[i], share = frame.true_pose[i];
      const inUnits = axis && share !== null && share !== undefined ? number(axis[2] + share * (axis[3] - axis[2])) + ' ' + axis[1] : number(share);
      return make('tr', {}, make('th', {scope: 'row', textContent: axis ? axis[0] : 'axis ' + (i + 1)}), make('td', {className: 'number', textContent: inUnits}),
        make('td', {className: 'number', textContent: number(commanded)}));
    })));
    return [errors, pose];
  }

  function start(data) {
    const {references, axes} = data.replay;
    const trials = data.replay.trials.map((trial) => ({...trial, frames: trial.frames.map(
      ([step, commanded_pose, true_pose, measured, commanded, recommended, seconds]) =>
        ({step, commanded_pose, true_pose, measured, commanded, recommended, seconds}))}));
    if (trials.length === 0) return;
    const selects = {group: byId('replay-group'), method: byId('replay-method'), why: byId('replay-why')};
    const slider = byId('replay-slider'), play = byId('replay-play'), strip = byId('replay-strip');
    let trial = trials[0], views = [], at = 0, timer = null;

    const fill = (select, values, text) => {
      const kept = select.value;
      select.replaceChildren(...options(values.map((value) => [value, text(value)])));
      if (values.some((value) => String(value) === kept)) select.value = kept;
    };
    const distinct = (list, key) => [...new Set(list.map((one) => one[key]))];

    function stop() {
      clearInterval(timer);
      timer = null;
      play.textContent = 'Play';
    }

    function go(to) {
      at = Math.max(0, Math.min(views.length - 1, to));
      const view = views[at];
      show(byId('replay-picture'), view.place);
      byId('replay-caption').textContent = view.title;
      byId('replay-facts').replaceChildren(...facts(view.frame, axes[trial.scene]));
      slider.value = at;
      slider.setAttribute('aria-valuetext', view.title);
      [...strip.children].forEach((tile, i) => tile.setAttribute('aria-current', i === at));
    }

    function choose() {
      const inGroup = trials.filter((one) => String(one.group) === selects.group.value);
      fill(selects.method, distinct(inGroup, 'method'), (name) => name);
      const ofMethod = inGroup.filter((one) => one.method === selects.method.value);
      fill(selects.why, ofMethod.map((one) => one.why), (why) => WHY[why] + ' (instance ' + ofMethod.find((one) => one.why === why).instance + ')');
      trial = ofMethod.find((one) => one.why === selects.why.value);
      const reference = references[trial.scene];
      views = viewsOf(trial, reference);
      slider.max = views.length - 1;
      byId('replay-reference').hidden = !reference;
      if (reference) show(byId('replay-reference').querySelector('svg'), whole(reference));
      strip.replaceChildren(...views.map((view, i) => {
        const tile = make('button', {type: 'button', title: view.title}, newPicture(view.place), make('span', {textContent: view.label}));
        tile.addEventListener('click', () => { stop(); go(i); });
        return tile;
      }));
      go(Math.min(at, views.length - 1));
    }

    function toggle() {
      if (timer !== null) return stop();
      if (at === views.length - 1) go(0);
      play.textContent = 'Pause';
      timer = setInterval(() => { if (at < views.length - 1) go(at + 1); if (at === views.length - 1) stop(); }, TICK_MS);
    }

    for (const select of Object.values(selects)) select.addEventListener('change', () => { stop(); choose(); });
    slider.addEventListener('input', () => { stop(); go(Number(slider.value)); });
    play.addEventListener('click', toggle);
    byId('replay-viewer').addEventListener('keydown', (event) => {
      if (event.target.tagName === 'SELECT') return;
      const move = {ArrowLeft: at - 1, ArrowRight: at + 1, Home: 0, End: views.length - 1}[event.key];
      if (move !== undefined) { stop(); go(move); } else if (event.key === ' ' && event.target.tagName !== 'BUTTON') toggle();
      else return;
      event.preventDefault();
    });
    fill(selects.group, distinct(trials, 'group'), (group) => data.groups[group].label);
    choose();
    document.querySelector('.film-strips').open = false;
    byId('replay-viewer').hidden = false;
  }

  return {start};
})();
