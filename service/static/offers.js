/** What this service can do beyond the rest, read from its own contract. */

import { get } from "./api.js";
import { offerAuto } from "./choice.js";
import { offerExports } from "./take.js";

/** Offer a choice of models by the data, and export formats, where the service has them. */
export async function install() {
  const { paths } = await get("/openapi.json");
  const body = paths["/v1/fits"].post.requestBody.content["application/json"].schema;
  if ("models" in body.properties) offerAuto();
  const route = paths["/v1/fits/{fit_id}/export/{format}"]?.get;
  const formats = route?.parameters.find((/** @type {any} */ one) => one.name === "format")?.schema.enum ?? [];
  if (formats.length > 0) offerExports(formats);
}
