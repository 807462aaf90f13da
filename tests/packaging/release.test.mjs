// What a release needs: one version everywhere, links that lead somewhere from npm, and a crate that can be packaged.
import assert from "node:assert/strict";
import { existsSync, readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { withAbsoluteLinks } from "../../js/tools/pack.mjs";
import { newest, problems, versions } from "../../js/tools/release.mjs";
import { root } from "../../js/tools/shared.mjs";
import { runIn } from "./consumer.mjs";

/** @param {string} file */
const text = (file) => readFileSync(join(root, file), "utf8");

test("all files name one version", () => {
  assert.deepEqual(problems(versions()), []);
});

test("the lock file installs anywhere: from no certain host, and with the binaries of every platform", () => {
  /** @type {{ packages: Record<string, { resolved?: string, integrity?: string, optionalDependencies?: object }> }} */
  const { packages } = JSON.parse(text("package-lock.json"));
  for (const [path, { resolved, integrity, optionalDependencies = {} }] of Object.entries(
    packages,
  )) {
    assert.equal(resolved, undefined, path);
    if (path !== "") assert.ok(integrity, path);
    for (const name of Object.keys(optionalDependencies)) {
      const found = [`node_modules/${name}`, `${path}/node_modules/${name}`].some(
        (at) => packages[at],
      );
      assert.ok(found, `${path} lacks ${name}: was it missing from the registry at that version?`);
    }
  }
});

test("a tag is compared with the version of every file", () => {
  const found = new Map([
    ["package.json", "1.2.3"],
    ["Cargo.toml", "1.2.2"],
    ["CHANGELOG.md", undefined],
  ]);
  assert.deepEqual(problems(new Map([["package.json", "1.2.3"]]), "v1.2.3", "2026-11-22"), []);
  assert.deepEqual(problems(found, "v1.2.3", "unreleased"), [
    "Cargo.toml says 1.2.2, not 1.2.3",
    "CHANGELOG.md says nothing, not 1.2.3",
    "CHANGELOG.md calls 1.2.3 unreleased: it needs the date",
  ]);
  assert.match(
    problems(new Map([["package.json", "1.2"]]), "1.2").join("; "),
    /semantic.*begin with v/,
  );
});

test("the newest version of the changelog is found", () => {
  const log = "# Changelog\n\n## 1.1.0 (2026-02-03)\n\nMore.\n\n## 1.0.0 (2026-01-02)\n\nFirst.\n";
  assert.deepEqual(newest(log), { version: "1.1.0", date: "2026-02-03" });
  assert.deepEqual(newest("## 1.0.0 (unreleased)\n"), { version: "1.0.0", date: "unreleased" });
});

test("the packed README has absolute links only", () => {
  const readme = withAbsoluteLinks(text("README.md"), "1.2.3");
  const links = [...readme.matchAll(/\]\(([^)\s]+)/g)].map(([, address = ""]) => address);
  assert.ok(links.length > 10);
  for (const link of links) assert.match(link, /^https:\/\//);
  const address = "https://github.com/depthstitch/depthstitch";
  assert.ok(links.includes(`${address}/blob/v1.2.3/docs/guide.md`));
  assert.ok(links.includes(`${address}/tree/v1.2.3/examples`));
  assert.ok(
    links.includes(
      "https://raw.githubusercontent.com/depthstitch/depthstitch/v1.2.3/www/pictures/mosaic.jpg",
    ),
  );
  assert.throws(() => withAbsoluteLinks("[a](docs/none.md)", "1.2.3"), /does not exist/);
});

test("package.json and Cargo.toml describe one project", () => {
  const { repository, homepage, bugs, keywords, license } = JSON.parse(text("package.json"));
  const manifest = text("Cargo.toml");
  const address = /^repository = "(.+)"$/m.exec(manifest)?.[1];
  assert.equal(repository.url, `git+${address}.git`);
  assert.ok(homepage.startsWith(address) && bugs.url === `${address}/issues`);
  assert.ok(keywords.length > 4);
  assert.ok(manifest.includes(`license = "${license}"`));
});

test("the crate is packaged with its sources, and without tests, pages and JavaScript", () => {
  const files = runIn(root, "cargo", ["package", "--list", "--allow-dirty", "--offline"])
    .trim()
    .split("\n");
  for (const file of ["Cargo.toml", "README.md", "LICENSE", "CHANGELOG.md", "src/lib.rs"]) {
    assert.ok(files.includes(file), file);
  }
  const others = files.filter(
    (file) => !/^(?:src\/|Cargo\.|README|LICENSE|CHANGELOG|\.cargo_vcs)/.test(file),
  );
  assert.deepEqual(others, []);
});

test("the workflows run scripts that exist, by actions of a fixed commit", () => {
  const folder = join(root, ".github", "workflows");
  const scripts = JSON.parse(text("package.json")).scripts;
  for (const file of readdirSync(folder)) {
    const workflow = readFileSync(join(folder, file), "utf8");
    for (const [, action = ""] of workflow.matchAll(/\buses: (\S+)/g)) {
      if (!action.startsWith("./")) assert.match(action, /@[0-9a-f]{40}$/, file);
    }
    for (const [, name = ""] of workflow.matchAll(/\bnpm run (?:--silent )?([\w:-]+)/g)) {
      assert.ok(name in scripts, `${file}: npm run ${name}`);
    }
    for (const [, path = ""] of workflow.matchAll(/\bnode (js\/\S+\.mjs)/g)) {
      assert.ok(existsSync(join(root, path)), `${file}: ${path}`);
    }
  }
});
