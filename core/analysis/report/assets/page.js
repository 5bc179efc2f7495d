// Starts the sortable tables, the charts, the replay and the curves.
'use strict';

(() => {
  const {byId} = relign;

  // Print with all details open, except the gallery: the cards show the most important pictures.
  const closed = [];
  window.addEventListener('beforeprint', () => {
    for (const part of document.querySelectorAll('details:not([open]):not(.gallery)')) {
      part.open = true;
      closed.push(part);
    }
  });
  window.addEventListener('afterprint', () => {
    for (const part of closed.splice(0)) part.open = false;
  });

  // A chart within closed details is drawn when they open, or for print.
  function prepare(figure, {name, chart}) {
    const place = figure.querySelector('.chart'), details = figure.closest('details');
    const draw = () => { if (!place.hasChildNodes()) new relignChart.Chart(place, chart, {name}); };
    figure.hidden = false;
    if (!details || details.open) draw();
    else details.addEventListener('toggle', draw);
    window.addEventListener('beforeprint', draw);
  }

  const data = JSON.parse(byId('report-data').textContent);
  relignSorting.start();
  if (data.replay) relignReplay.start(data);
  try {
    for (const figure of document.querySelectorAll('figure[data-chart]')) prepare(figure, data.charts[figure.dataset.chart]);
    if (!data.methods) return;
    relignCurves.expand(data);
    document.documentElement.dataset.curves = String(relignCurves.start(data));
  } catch (problem) {
    byId('curves-problem').hidden = false;
    byId('curves-problem').textContent = 'The curves could not be drawn (' + problem.message + '); curves.csv has the same numbers.';
    document.documentElement.dataset.curves = 'failed';
  }
})();
