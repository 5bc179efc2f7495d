"""Makes docs/images/card.png, the picture of links to the site, from pictures of docs/paper. Needs Chromium."""

import pathlib
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
PICTURES = [("start.png", "start"), ("nominal.png", "nominal pose"), ("reference.png", "reference")]
STYLE = """body{margin:0;width:1200px;height:630px;background:#14161d;color:#fff;font-family:"DejaVu Sans",sans-serif;
overflow:hidden}
h1{font-size:68px;margin:38px 60px 4px}p{font-size:29px;margin:0 60px 30px;color:#c3c9d8}
div{display:flex;gap:36px;margin:0 60px}figure{margin:0;width:336px}
img{width:336px;height:336px;image-rendering:pixelated}figcaption{font-size:24px;color:#c3c9d8;margin-top:4px}"""

figures = "".join(f'<figure><img src="{(ROOT / "docs" / "paper" / file).as_uri()}"><figcaption>{text}</figcaption></figure>'
                  for file, text in PICTURES)
with tempfile.TemporaryDirectory() as folder:
    page = pathlib.Path(folder, "card.html")
    page.write_text(f"<meta charset=utf-8><style>{STYLE}</style><h1>relign-bench</h1><p>Benchmark for active alignment of "
                    f"lenses and image sensors</p><div>{figures}</div>")
    subprocess.run(["chromium", "--headless", "--no-sandbox", "--hide-scrollbars", "--window-size=1200,630",
                    f"--screenshot={ROOT / 'docs' / 'images' / 'card.png'}", page.as_uri()], check=True)
