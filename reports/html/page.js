// The theme: as the system says until the reader says otherwise. Whoever draws on a canvas listens for 'themechange'.

const root = document.documentElement;
const prefersDark = matchMedia('(prefers-color-scheme: dark)');

function isDark() {
  return root.dataset.theme ? root.dataset.theme === 'dark' : prefersDark.matches;
}

function themeChanged() {
  const button = document.getElementById('theme');
  const other = isDark() ? 'light' : 'dark';
  button.textContent = other === 'dark' ? 'Dark' : 'Light';
  button.setAttribute('aria-label', `Change to the ${other} theme`);
  document.dispatchEvent(new Event('themechange'));
}

// A page from disk may be refused a memory: then it has none.
function remembered() {
  try { return localStorage.getItem('teleop-sim-theme') || ''; } catch { return ''; }
}

function remember(theme) {
  try { localStorage.setItem('teleop-sim-theme', theme); } catch { /* none */ }
}

function startTheme() {
  const theme = remembered();
  if (theme === 'light' || theme === 'dark') root.dataset.theme = theme;
  document.getElementById('theme').addEventListener('click', () => {
    root.dataset.theme = isDark() ? 'light' : 'dark';
    remember(root.dataset.theme);
    themeChanged();
  });
  prefersDark.addEventListener('change', themeChanged);
  themeChanged();
}

startTheme();
