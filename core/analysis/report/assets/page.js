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

  // A chart within closed details is drawn when they open.
  function drawFigure(figure, specs) {
    const draw = () => {
      if (figure.dataset.drawn) return;
      figure.dataset.drawn = 'yes';
      new relignChart.Chart(figure.querySelector('.chart'), specs[figure.dataset.chart].chart, {name: specs[figure.dataset.chart].name});
    };
    figure.hidden = false;
    const details = figure.closest('details');
    if (!details || details.open) draw();
    else details.addEventListener('toggle', draw);
  }

  const data = JSON.parse(byId('report-data').textContent);
  relignSorting.start();
  if (data.replay) relignReplay.start(data);
  try {
    for (const figure of document.querySelectorAll('figure[data-chart]')) drawFigure(figure, data.charts);
    if (!data.methods) return;
    relignCurves.expand(data);
    document.documentElement.dataset.curves = String(relignCurves.start(data));
  } catch (problem) {
    byId('curves-problem').hidden = false;
    byId('curves-problem').textContent = 'The curves could not be drawn (' + problem.message + '); curves.csv has the same numbers.';
    document.documentElement.dataset.curves = 'failed';
  }
})();
