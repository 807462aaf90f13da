import { digest } from "../digest.mjs";

document.title = await digest(async (name) => (await fetch(name)).arrayBuffer()).catch(String);
