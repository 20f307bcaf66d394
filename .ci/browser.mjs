// Opens reports in headless Chromium and looks whether they do what a reader expects.
//   node browser.mjs CHROMIUM PAGE.html...
// Needs the package playwright-core. PICTURES=FOLDER keeps screenshots there.
import { createRequire } from 'node:module';
import { basename, join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';

// from the folder that it is called in, wherever this file lies
const { chromium } = createRequire(join(process.cwd(), 'x.js'))('playwright-core');
const [program, ...pages] = process.argv.slice(2);
const pictures = process.env.PICTURES;
let failed = 0, passed = 0;

function check(page, what, holds, seen = '') {
  if (holds) { passed++; return; }
  failed++;
  console.log(`${page}: FAILED: ${what}${seen === '' ? '' : ` (${seen})`}`);
}

const browser = await chromium.launch({
  executablePath: program,
  args: ['--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync'],
});

// A page in circumstances of its own; every message and every request is kept.
async function opened(file, { width = 1280, scheme = 'light', script = true } = {}) {
  const context = await browser.newContext({
    viewport: { width, height: 900 }, colorScheme: scheme, javaScriptEnabled: script,
  });
  const page = await context.newPage();
  const said = [], asked = [];
  page.on('console', m => { if (['error', 'warning'].includes(m.type())) said.push(m.text()); });
  page.on('pageerror', e => said.push(String(e)));
  page.on('request', r => asked.push(r.url()));
  await page.goto(pathToFileURL(resolve(file)).href);
  if (script) await page.waitForTimeout(300);
  return { context, page, said, asked };
}

// How much each figure shows: the longest path of each visible picture, or its shapes.
const drawn = page => page.$$eval('figure', figures => figures.map(figure => {
  const svgs = [...figure.querySelectorAll('.still > svg, .plot > svg')].filter(s => s.getClientRects().length);
  const lengths = svgs.flatMap(s => [...s.querySelectorAll('path')].map(p => p.getAttribute('d').length));
  const shapes = svgs.map(s => 5 * s.querySelectorAll('rect, circle, path').length);
  return Math.max(0, ...lengths, ...shapes);
}));

const range = figure => figure.evaluate(f => [Number(f.dataset.from), Number(f.dataset.to)]);
const span = ([a, b]) => b - a;
const brightness = text => text.match(/\d+/g).slice(0, 3).reduce((s, c) => s + Number(c), 0) / 3;

async function zooming(name, page) {
  const figures = await page.$$('figure.live');
  for (const figure of figures) {
    const plot = await figure.$('.plot');
    const settled = () => page.evaluate(() => new Promise(done =>
      requestAnimationFrame(() => requestAnimationFrame(done))));
    await plot.scrollIntoViewIfNeeded();
    const whole = await range(figure);
    const box = await plot.boundingBox();
    const x = share => box.x + 60 + share * (box.width - 70), y = Math.max(box.y, 0) + 60;
    await page.mouse.move(x(0.5), y);
    await page.mouse.wheel(0, -300);
    await settled();
    check(name, 'the wheel leaves the plot alone before a click', span(await range(figure)) === span(whole));
    await plot.scrollIntoViewIfNeeded();
    const again = await plot.boundingBox();
    const top = Math.max(again.y, 0) + 60;
    await page.mouse.click(x(0.5), top);
    await page.mouse.wheel(0, -300);
    await settled();
    const wheeled = await range(figure);
    check(name, 'the wheel zooms', span(wheeled) < 0.9 * span(whole), wheeled);
    const paths = await figure.$$eval('.plot path.l', all => all.map(p => p.getAttribute('d').length));
    check(name, 'every panel is drawn when zoomed', paths.length > 0 && paths.every(l => l > 20), paths);
    await page.keyboard.press('+');
    await settled();
    const keyed = await range(figure);
    check(name, 'the key + zooms', span(keyed) < 0.9 * span(wheeled), keyed);
    await page.keyboard.press('ArrowRight');
    await settled();
    const moved = await range(figure);
    check(name, 'an arrow moves', moved[0] > keyed[0] && Math.abs(span(moved) - span(keyed)) < 1e-6 * span(keyed), moved);
    await page.keyboard.press('Home');
    await settled();
    const home = span(await range(figure)) / span(whole);
    check(name, 'Home shows everything', Math.abs(home - 1) < 1e-9, home);
    await page.mouse.move(x(0.25), top);
    await page.mouse.down();
    await page.mouse.move(x(0.5), top, { steps: 4 });
    await page.mouse.up();
    await settled();
    const picked = await range(figure);
    check(name, 'a drag zooms into its interval', Math.abs(span(picked) / span(whole) - 0.25) < 0.03, picked);
    await page.keyboard.press('0');
    await settled();
    const choice = await figure.$('select');
    if (choice) {
      await choice.selectOption({ index: 1 });
      await settled();
      const other = await figure.$$eval('.plot path.l', all => all.map(p => p.getAttribute('d').length));
      check(name, 'the other form is drawn', other.every(l => l > 20), other);
      await choice.selectOption({ index: 0 });
    }
    const named = await plot.getAttribute('aria-label');
    check(name, 'the plot has a name and can be reached by Tab', named && (await plot.evaluate(p => p.tabIndex)) === 0);
  }
  return figures.length;
}

// What reaches beyond the view, is wider than the box that it scrolls in, or is text beyond its picture. Folded
// parts are unfolded first.
const clipped = page => page.evaluate(() => {
  for (const folded of document.querySelectorAll('details')) folded.open = true;
  const named = e => `${e.tagName} ${e.getAttribute('class') ?? ''} ${e.textContent.trim().slice(0, 30)}`;
  const found = [];
  for (const e of document.querySelectorAll('body *')) {
    const box = e.getBoundingClientRect();
    if (!box.width || !box.height || e.closest('defs, title, desc, clipPath')) continue;
    const picture = e.ownerSVGElement;
    if (picture) {
      // lines end where their panel is clipped; words are to be read whole
      if (e.tagName !== 'text') continue;
      const frame = picture.getBoundingClientRect();
      if (box.left < frame.left - 1 || box.right > frame.right + 1) found.push(named(e));
      continue;
    }
    if (box.left < -1 || box.right > innerWidth + 1) found.push(named(e));
    const scrolls = getComputedStyle(e).overflowX !== 'visible';
    if (scrolls && e.scrollWidth > e.clientWidth + 1) found.push(named(e));
  }
  return found.slice(0, 5);
});

// Words whose contrast with what lies behind them is below that of WCAG 2.1 AA.
const faint = page => page.evaluate(() => {
  const channels = text => text.match(/[\d.]+/g).map(Number);
  const light = ([r, g, b]) => {
    const [x, y, z] = [r, g, b].map(c => c / 255).map(c => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
    return 0.2126 * x + 0.7152 * y + 0.0722 * z;
  };
  const behind = element => {
    for (let e = element; e; e = e.parentElement) {
      const colour = channels(getComputedStyle(e).backgroundColor);
      if (colour.length < 4 || colour[3] > 0) return colour;
    }
    return [255, 255, 255];
  };
  const found = new Set();
  for (const e of document.querySelectorAll('body *')) {
    const own = [...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim());
    if (!own || !e.getClientRects().length || ['SCRIPT', 'STYLE', 'title', 'desc'].includes(e.tagName)) continue;
    const style = getComputedStyle(e), drawn = e instanceof SVGElement;
    const [a, b] = [light(channels(drawn ? style.fill : style.color)), light(behind(e))].sort((a, b) => b - a);
    const size = parseFloat(style.fontSize), large = size >= 24 || size >= 18.7 && parseInt(style.fontWeight) >= 700;
    if ((a + 0.05) / (b + 0.05) < (large ? 3 : 4.5)) found.add(`${e.tagName} ${e.textContent.trim().slice(0, 30)}`);
  }
  return [...found];
});

// The readout of a cursor names each line of its panel.
async function reading(name, page) {
  for (const figure of await page.$$('figure.live')) {
    const plot = await figure.$('.plot');
    await plot.scrollIntoViewIfNeeded();
    const box = await plot.boundingBox();
    await page.mouse.move(box.x + 0.5 * box.width, Math.max(box.y, 0) + 60);
    await page.waitForTimeout(60);
    const [keys, readouts] = await figure.evaluate(f => [
      [...f.querySelectorAll('.key')].map(k => k.textContent), [...f.querySelectorAll('text.over')].map(t => t.textContent)]);
    check(name, 'every panel has a readout that names a line',
      readouts.length > 0 && readouts.every(r => keys.some(k => r.includes(k))), readouts);
    await page.mouse.move(1, 1);
  }
}

// Two fingers on a phone.
async function pinching(name, file) {
  const context = await browser.newContext({ viewport: { width: 360, height: 740 }, hasTouch: true, isMobile: true });
  const page = await context.newPage();
  await page.goto(pathToFileURL(resolve(file)).href);
  const figure = await page.$('figure.live');
  if (figure) {
    const plot = await figure.$('.plot');
    await plot.scrollIntoViewIfNeeded();
    const whole = await range(figure);
    const box = await plot.boundingBox();
    const y = Math.max(box.y, 0) + 80, middle = box.x + 0.5 * box.width;
    const session = await context.newCDPSession(page);
    const touch = (type, half) => session.send('Input.dispatchTouchEvent', {
      type, touchPoints: half ? [{ x: middle - half, y, id: 1 }, { x: middle + half, y, id: 2 }] : [],
    });
    await touch('touchStart', 30);
    for (const half of [40, 60, 80, 90]) await touch('touchMove', half);
    await touch('touchEnd');
    await page.waitForTimeout(100);
    const pinched = await range(figure);
    check(name, 'two fingers zoom', span(pinched) < 0.6 * span(whole), pinched);
  }
  await context.close();
}

for (const file of pages) {
  const name = basename(file);
  const wide = await opened(file);
  check(name, 'no error is told', wide.said.length === 0, wide.said.join('; '));
  check(name, 'nothing is asked for but the page', wide.asked.length === 1, wide.asked.slice(1).join(' '));
  const lengths = await drawn(wide.page);
  check(name, 'every figure is drawn', lengths.length > 0 && lengths.every(l => l > 40), lengths);
  check(name, 'words stand out', (await faint(wide.page)).length === 0, await faint(wide.page));
  await reading(name, wide.page);
  const live = await zooming(name, wide.page);
  check(name, 'no error is told after zooming', wide.said.length === 0, wide.said.join('; '));
  if (pictures) await wide.page.screenshot({ path: join(pictures, `${name}-wide.png`), fullPage: true });
  await wide.page.emulateMedia({ media: 'print' });
  const paper = await wide.page.$$eval('figure', all => all.every(f =>
    f.querySelector('.still').getClientRects().length && !f.querySelector('.viewer')?.getClientRects().length));
  check(name, 'paper shows the still pictures', paper);
  await wide.context.close();

  for (const width of [360, 390, 768, 1280, 1920]) {
    const narrow = await opened(file, { width });
    const over = await narrow.page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    check(name, `nothing hangs over at ${width} px`, over <= 0, over);
    check(name, `every figure is drawn at ${width} px`, (await drawn(narrow.page)).every(l => l > 40));
    const cut = await clipped(narrow.page);
    check(name, `nothing is cut or has to be scrolled sideways at ${width} px`, cut.length === 0, cut);
    if (pictures && ![768, 1280].includes(width)) {
      await narrow.page.screenshot({ path: join(pictures, `${name}-${width}.png`), fullPage: true });
    }
    await narrow.context.close();
  }

  const dark = await opened(file, { scheme: 'dark' });
  const colours = await dark.page.evaluate(() => {
    const of = (e, key) => e && getComputedStyle(e)[key];
    return [of(document.body, 'backgroundColor'), of(document.body, 'color'),
      of([...document.querySelectorAll('.still text')].find(t => t.getClientRects().length), 'fill'),
      of(document.querySelector('.viewer text'), 'fill')];
  });
  check(name, 'dark is dark', brightness(colours[0]) < 60, colours[0]);
  check(name, 'words stand out in the dark', (await faint(dark.page)).length === 0, await faint(dark.page));
  check(name, 'words are bright in the dark', colours.slice(1).filter(Boolean).every(c => brightness(c) > 150), colours);
  if (pictures) await dark.page.screenshot({ path: join(pictures, `${name}-dark.png`), fullPage: true });
  await dark.context.close();

  const plain = await opened(file, { script: false });
  check(name, 'every figure is drawn without a script', (await drawn(plain.page)).every(l => l > 40));
  await plain.context.close();
  await pinching(name, file);
  console.log(`${name}: ${lengths.length} figures, ${live} of them live`);
}
await browser.close();
console.log(`${passed} checks passed, ${failed} failed`);
process.exit(failed ? 1 : 0);
