/* Under each drawn figure a button that saves it as one SVG file, with the colours that the page has now. */
for (const figure of document.querySelectorAll('figure')) {
  const panels = figure.querySelector('.panels'), plots = [...panels.querySelectorAll('svg.plot')];
  if (!plots.length || panels.querySelector('img, .player')) continue;
  const button = Object.assign(document.createElement('button'), {type: 'button', textContent: 'Save as SVG'});
  button.className = 'save';
  button.onclick = () => {
    const page = panels.getBoundingClientRect(), look = getComputedStyle(document.documentElement);
    const names = ['ink', 'muted', 'line', 'paper', 'cup', 'ball', 'good', 'explored', 'other', 'sans'];
    const values = names.map(name => `--${name}:${look.getPropertyValue(`--${name}`).trim()}`).join(';');
    const whole = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
    const ends = plots.map(plot => plot.getBoundingClientRect().right - page.left);
    const [width, height] = [Math.max(panels.scrollWidth, ...ends), panels.scrollHeight].map(Math.ceil);
    whole.setAttribute('viewBox', `0 0 ${width} ${height}`);
    whole.setAttribute('width', width); whole.setAttribute('height', height);
    const style = document.createElementNS(whole.namespaceURI, 'style');
    style.textContent = `svg{${values};color:var(--ink)}svg text{font-family:var(--sans)!important}`;
    const back = document.createElementNS(whole.namespaceURI, 'rect');
    back.setAttribute('width', width); back.setAttribute('height', height); back.setAttribute('fill', 'var(--paper)');
    whole.append(style, back);
    for (const title of panels.querySelectorAll('h3')) {
      const at = title.getBoundingClientRect(), text = document.createElementNS(whole.namespaceURI, 'text');
      text.setAttribute('x', at.left - page.left); text.setAttribute('y', at.top - page.top + 13);
      text.setAttribute('style', 'font-size:13px;font-weight:600'); text.setAttribute('fill', 'var(--ink)');
      text.textContent = [...title.childNodes].map(node => node.textContent).join('  ');
      whole.append(text);
    }
    for (const plot of plots) {
      const at = plot.getBoundingClientRect(), copy = plot.cloneNode(true);
      for (const [name, value] of [['x', at.left - page.left], ['y', at.top - page.top], ['width', at.width],
        ['height', at.height]]) copy.setAttribute(name, value.toFixed(1));
      whole.append(copy);
    }
    const text = new XMLSerializer().serializeToString(whole);
    const link = document.createElement('a');
    const made = URL.createObjectURL(new Blob([text], {type: 'image/svg+xml'}));
    link.setAttribute('href', made);
    link.download = `${document.title.replace(/[^\w-]+/g, '-')}-${figure.id}.svg`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(made), 10000);
  };
  figure.append(button);
}
