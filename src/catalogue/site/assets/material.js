'use strict';
// Buttons that copy a text.
(() => {
  const said = document.getElementById('copied');
  const select = (place) => {
    const range = document.createRange();
    range.selectNodeContents(place);
    const selection = window.getSelection();
    selection.removeAllRanges();
    selection.addRange(range);
  };
  for (const button of document.querySelectorAll('button.copy')) {
    const place = document.getElementById(button.dataset.copies);
    button.hidden = false;
    button.addEventListener('click', async () => {
      try {
        await navigator.clipboard.writeText(place.textContent);
        said.textContent = 'Copied.';
      } catch {
        select(place);
        said.textContent = 'It is selected now; copy it with your keyboard.';
      }
    });
  }
})();
