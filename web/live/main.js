// The live page: bodies that a file beside it holds.
import { element, Page, show_failure, start_bodies } from './page.js';
import { load_page_file, open_page_file } from './page_file.js';

async function open() {
  try {
    const tell = (text) => { element('loading-text').textContent = text; };
    const file = open_page_file(await load_page_file((part) => tell(`Loading the bodies: ${Math.round(100 * part)} %`)));
    tell('Preparing the bodies');
    const { worker, opened, live } = await start_bodies(file);
    window.filigree = new Page(file, live, opened, worker);
    element('loading').remove();
  } catch (cause) {
    show_failure(cause.message);
  }
}

open();
